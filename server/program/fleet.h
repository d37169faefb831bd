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
inline fleet::NatsOptions natsOptions(const NatsOptions& nats, const char* role) {
  return {.servers = nats.servers,
          .credentials = nats.credentials,
          .authority = nats.authority,
          .name = kServerName,
          .role = role};
}

// Clients of other servers are sent to the first public name; an address is none.
inline fleet::OriginOptions originOptions(const NetworkOptions& network) {
  const auto name = std::ranges::find_if_not(network.publicNames, &isAddress);
  return {.publicName = name == network.publicNames.end() ? "" : *name, .version = kServerVersion};
}

}  // namespace clothstream::program
