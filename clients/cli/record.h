// SPDX-License-Identifier: MIT
// `clothstream record`: writes a stream down as it comes.
#pragma once

#include <optional>
#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct RecordOptions {
  std::string address;  // as completeAddress gives it
  std::string scene;    // empty: the server's default
  std::string output;
  std::optional<double> seconds;  // nothing: until a signal
  std::string program;            // name and version of this one
};

// SIGINT and SIGTERM must be blocked: they end the recording like the end of its time, and it is whole.
ExitCode record(const RecordOptions& options);

}  // namespace clothstream::cli
