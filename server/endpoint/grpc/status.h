// SPDX-License-Identifier: MIT
// Errors of the protocol as gRPC statuses.
#pragma once

#include <grpcpp/support/status.h>

#include "clothstream/v1/session.pb.h"
#include "server/session/closing.h"
#include "server/telemetry/refusal.h"

namespace clothstream::endpoint {

grpc::Status statusOf(const v1::Error& error);

// RESOURCE_EXHAUSTED for a stream or a health watch that an Admission refuses.
grpc::Status statusOf(telemetry::Refusal reason);

// NOT_FOUND for a deleted scene, UNAVAILABLE if the server stops.
grpc::Status statusOf(const session::Closing& closing);

}  // namespace clothstream::endpoint
