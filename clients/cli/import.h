// SPDX-License-Identifier: MIT
// `clothstream import`: makes a recording of a motion that another program computed.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "clients/cli/motion.h"

namespace clothstream::cli {

struct ImportOptions {
  std::string states;  // .npz
  ArrayOptions arrays;
  recording::ReadLimits limits{};
  std::string output;      // recording; must not exist
  std::string scene;       // name of the scene in the recording
  double maxError = 1e-5;  // metres; a vertex is at most sqrt(3) times that away from its place
  std::string program;     // name and version of this program
};

// SIGINT and SIGTERM must be blocked in every thread; they cancel the command and leave no file.
ExitCode importStates(const ImportOptions& options);

}  // namespace clothstream::cli
