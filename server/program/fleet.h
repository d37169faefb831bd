// SPDX-License-Identifier: MIT
// Connection of the program to other servers.
#pragma once

#include "server/fleet/nats.h"
#include "server/fleet/origin.h"
#include "server/options/program_options.h"

namespace clothstream::program {

inline fleet::NatsOptions natsOptions(const ProgramOptions& options) {
  return {.servers = options.natsServers,
          .credentials = options.natsCredentials,
          .authority = options.natsAuthority,
          .name = kServerName};
}

inline fleet::OriginOptions originOptions(const ProgramOptions& options) {
  return {.publicName = options.publicNames.empty() ? "" : options.publicNames.front(),
          .version = kServerVersion};
}

}  // namespace clothstream::program
