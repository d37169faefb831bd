// SPDX-License-Identifier: MIT
// `clothstream info`: shows the content of a recording and checks it.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct InfoOptions {
  std::string recording;
  recording::ReadLimits limits{};
  bool quick = false;  // reads only the index
  bool json = false;
};

// Reads and checks the whole file unless `quick`. SIGINT and SIGTERM must be blocked in every thread.
ExitCode info(const InfoOptions& options);

}  // namespace clothstream::cli
