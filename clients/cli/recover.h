// SPDX-License-Identifier: MIT
// `clothstream recover`: writes a complete recording from a damaged one.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct RecoverOptions {
  std::string recording, out;
  recording::ReadLimits limits{};
};

// Reads the written file again and compares it; removes it if it differs. SIGINT and SIGTERM must be blocked
// in every thread; they cancel the command and leave no file.
ExitCode recover(const RecoverOptions& options);

}  // namespace clothstream::cli
