// SPDX-License-Identifier: MIT
// Addresses under which clients reach the server.
#pragma once

#include <cstdint>
#include <string>

#include "server/options/program_options.h"

namespace clothstream::program {

// Address under which a client on this machine reaches the endpoint.
std::string localAddress(const std::string& host, std::uint16_t port);

// Whether the text is an IPv4 or IPv6 address.
bool isAddress(const std::string& text);

// The first address of this machine that others in its network can reach, or empty.
std::string addressInNetwork(const NetworkOptions& network);

}  // namespace clothstream::program
