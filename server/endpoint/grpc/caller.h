// SPDX-License-Identifier: MIT
// Who makes a gRPC call: its address and its token.
#pragma once

#include <string>

#include <boost/asio/ip/address.hpp>
#include <grpcpp/server_context.h>

namespace clothstream::endpoint {

// Address of a peer as gRPC writes it, such as ipv4:192.0.2.1:50000 or ipv6:%5B2001:db8::1%5D:50000. A
// text of another form gives the unspecified address.
boost::asio::ip::address addressOf(const std::string& peer);

// Key (addressKey) of a peer as gRPC writes it, such as ipv4:192.0.2.1:50000. Empty for programs of this
// machine.
std::string addressKeyOf(const std::string& peer);

// Address of this machine that a peer has reached, if that is known: gRPC does not say, but a program of this
// machine that has a loopback address has reached the same one. Empty for others.
std::string reachedBy(const std::string& peer);

// Token in the metadata of the call, `authorization: Bearer TOKEN`; empty without one.
std::string tokenIn(const grpc::ServerContext& context);

}  // namespace clothstream::endpoint
