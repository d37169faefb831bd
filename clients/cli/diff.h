// SPDX-License-Identifier: MIT
// `clothstream diff`: compares two recordings tick by tick.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct DiffOptions {
  std::string a, b;      // recordings
  double tolerance = 0;  // largest distance of a vertex that counts as equal, metres; 0 compares bits
  bool json = false;
  recording::ReadLimits limits{};
};

// Exit code of the verdict. SIGINT and SIGTERM must be blocked in every thread.
ExitCode diff(const DiffOptions& options);

}  // namespace clothstream::cli
