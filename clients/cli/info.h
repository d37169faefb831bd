// SPDX-License-Identifier: MIT
// `clothstream info`: what is in a recording, and whether it is whole.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct InfoOptions {
  std::string recording;
  bool quick = false;  // by the index alone
  bool json = false;
};

// Reads all of it, unless it is to be quick. SIGINT and SIGTERM must be blocked.
ExitCode info(const InfoOptions& options);

}  // namespace clothstream::cli
