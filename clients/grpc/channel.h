// SPDX-License-Identifier: MIT
// Channels to a server, and failures from gRPC statuses.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>
#include <tl/expected.hpp>

#include "clients/grpc/address.h"
#include "clients/grpc/failure.h"

namespace clothstream {

// Throws std::runtime_error if the file of authorities cannot be read.
std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server);

// Adds the server's token, if any, to a call.
void authorize(grpc::ClientContext& call, const ServerAddress& server);

// Fingerprint of the key that the server at an https:// address shows, or empty if makeChannel() trusts the
// server already. Sends nothing but handshakes. Takes at most 20 s.
[[nodiscard]] tl::expected<std::string, Failure> unknownKeyOf(const ServerAddress& server);

// Failure of a call that ended before any message arrived.
Failure notJoined(const ServerAddress& server, const grpc::Status& status);
// Failure of a stream that ended although the client had not left.
Failure lost(const ServerAddress& server, const grpc::Status& status);

}  // namespace clothstream
