// SPDX-License-Identifier: MIT
// `clothstream list`: lists the scenes of a server.
#pragma once

#include <string>

#include "clients/cli/exit_code.h"
#include "clients/native/address.h"

namespace clothstream::cli {

struct ListOptions {
  ServerAddress address = std::string(kDefaultAddress);
  bool json = false;
};

ExitCode list(const ListOptions& options);

}  // namespace clothstream::cli
