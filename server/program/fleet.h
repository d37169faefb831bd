// SPDX-License-Identifier: MIT
// Connection of the program to other servers.
#pragma once

#include <algorithm>

#include "server/fleet/nats.h"
#include "server/fleet/origin.h"
#include "server/options/program_options.h"
#include "server/program/addresses.h"

namespace clothstream::program {

// `role`: server or edge.
inline fleet::NatsOptions natsOptions(const ProgramOptions& options, const char* role) {
  return {.servers = options.natsServers,
          .credentials = options.natsCredentials,
          .authority = options.natsAuthority,
          .name = kServerName,
          .role = role};
}

// Clients of other servers are sent to the first public name; an address is none.
inline fleet::OriginOptions originOptions(const ProgramOptions& options) {
  const auto name = std::ranges::find_if_not(options.publicNames, &isAddress);
  return {.publicName = name == options.publicNames.end() ? "" : *name, .version = kServerVersion};
}

}  // namespace clothstream::program
