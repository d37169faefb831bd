// SPDX-License-Identifier: MIT
// Errors of the protocol as gRPC statuses.
#pragma once

#include <grpcpp/support/status.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"

namespace clothstream::endpoint {

grpc::Status statusOf(const v1::Error& error);

// Status for a finished session, from its last message: a fatal Error, a notice that the scene was
// deleted, or else UNAVAILABLE because the server stops.
grpc::Status closingStatus(const delivery::SharedBytes& lastMessage);

}  // namespace clothstream::endpoint
