// SPDX-License-Identifier: MIT
// Errors of the protocol as gRPC statuses.
#pragma once

#include <grpcpp/support/status.h>

#include "clothstream/v1/session.pb.h"
#include "server/session/closing.h"

namespace clothstream::endpoint {

grpc::Status statusOf(const v1::Error& error);

// NOT_FOUND for a deleted scene, UNAVAILABLE if the server stops.
grpc::Status statusOf(const session::Closing& closing);

}  // namespace clothstream::endpoint
