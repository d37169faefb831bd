// SPDX-License-Identifier: MIT
// Who makes a gRPC call: its address and its token.
#pragma once

#include <string>

#include <grpcpp/server_context.h>

namespace clothstream::endpoint {

// Key (addressKey) of a peer as gRPC writes it, such as ipv4:192.0.2.1:50000. Empty for programs of this
// machine.
std::string addressKeyOf(const std::string& peer);

// Token in the metadata of the call, `authorization: Bearer TOKEN`; empty without one.
std::string tokenIn(const grpc::ServerContext& context);

}  // namespace clothstream::endpoint
