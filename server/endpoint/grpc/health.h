// SPDX-License-Identifier: MIT
// Calls of grpc.health.v1.Health. The server and its service are SERVING while the endpoint is open.
#pragma once

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/endpoint/grpc/call.h"

namespace clothstream::endpoint {

// gRPC's own health service would start threads that then also serve every other call (completion_loop.h).
using HealthService = grpc::health::v1::Health::WithAsyncMethod_Check<
    grpc::health::v1::Health::WithAsyncMethod_Watch<grpc::health::v1::Health::Service>>;

// Answers all calls of the service while the endpoint is open.
void offerHealth(GrpcEndpointContext& endpoint, HealthService& service);

}  // namespace clothstream::endpoint
