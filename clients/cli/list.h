// SPDX-License-Identifier: MIT
// `clothstream list`: the scenes of a server.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct ListOptions {
  std::string address;  // as completeAddress gives it
  bool json = false;
};

ExitCode list(const ListOptions& options);

}  // namespace clothstream::cli
