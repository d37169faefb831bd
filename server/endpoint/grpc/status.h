// SPDX-License-Identifier: MIT
// The protocol's errors as gRPC statuses.
#pragma once

#include <grpcpp/support/status.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/envelope.h"

namespace clothstream::endpoint {

grpc::Status statusOf(const v1::Error& error);

// Why a finished connection ends is what was said last: a fatal Error, that the scene was deleted, or else
// that the server stops.
grpc::Status closingStatus(const delivery::SharedBytes& lastMessage);

}  // namespace clothstream::endpoint
