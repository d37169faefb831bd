// SPDX-License-Identifier: MIT
// Channels to a server, and what gRPC's statuses mean to people.
#pragma once

#include <memory>
#include <string>

#include <grpcpp/channel.h>
#include <grpcpp/support/status.h>

#include "clients/grpc/failure.h"

namespace clothstream {

std::shared_ptr<grpc::Channel> makeChannel(const std::string& address);

// Of a call that ended before anything came.
Failure notJoined(const std::string& address, const grpc::Status& status);
// Of a stream that ended by itself.
Failure lost(const std::string& address, const grpc::Status& status);

}  // namespace clothstream
