// SPDX-License-Identifier: MIT
// `clothstream recover`: a whole recording of what a damaged one still holds.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct RecoverOptions {
  std::string recording, out;
};

// What was written is read again and compared before this says that all is well; otherwise there is no file.
// SIGINT and SIGTERM must be blocked: then there is none either.
ExitCode recover(const RecoverOptions& options);

}  // namespace clothstream::cli
