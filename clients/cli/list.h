// SPDX-License-Identifier: MIT
// `clothstream list`: lists the scenes of a server.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"

namespace clothstream::cli {

struct ListOptions {
  std::string address;  // from completeAddress()
  bool json = false;
};

ExitCode list(const ListOptions& options);

}  // namespace clothstream::cli
