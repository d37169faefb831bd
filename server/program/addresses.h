// SPDX-License-Identifier: MIT
// Addresses under which clients reach the server.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/endpoint/datagram/datagram_endpoint.h"
#include "server/options/program_options.h"

namespace clothstream::program {

// Address under which a client on this machine reaches the endpoint.
std::string localAddress(const std::string& host, std::uint16_t port);

// Whether the text is an IPv4 or IPv6 address.
bool isAddress(const std::string& text);

// Addresses of this machine that its peers can reach: `host`, or those of all interfaces if it stands for all
// addresses of IPv4 (0.0.0.0) or of both families (::). Loopback addresses are only among them if `host` is
// one.
std::vector<std::string> addressesOf(const std::string& host);

// Options of the endpoint for datagrams.
endpoint::DatagramEndpointOptions datagramOptions(const NetworkOptions& network);

// The first address of this machine that others in its network can reach, or empty.
std::string addressInNetwork(const NetworkOptions& network);

}  // namespace clothstream::program
