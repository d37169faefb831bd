// SPDX-License-Identifier: MIT
// Channels to a server, and failures from gRPC statuses.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

#include "clients/grpc/address.h"
#include "clients/grpc/failure.h"

namespace clothstream {

// Throws std::runtime_error if the file of authorities cannot be read.
std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server);

// Failure of a call that ended before any message arrived.
Failure notJoined(const ServerAddress& server, const grpc::Status& status);
// Failure of a stream that ended although the client had not left.
Failure lost(const ServerAddress& server, const grpc::Status& status);

}  // namespace clothstream
