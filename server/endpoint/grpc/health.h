// SPDX-License-Identifier: MIT
// The calls of grpc.health.v1.Health: the server and its service are well for as long as the endpoint is
// open.
#pragma once

#include "grpc/health/v1/health.grpc.pb.h"
#include "server/endpoint/grpc/call.h"

namespace clothstream::endpoint {

// gRPC's own would do, but it brings gRPC's own threads, which then share the work of every other call
// (completion_loop.h).
using HealthService = grpc::health::v1::Health::WithAsyncMethod_Check<
    grpc::health::v1::Health::WithAsyncMethod_Watch<grpc::health::v1::Health::Service>>;

// Answers all its calls, for as long as the endpoint is open.
void offerHealth(GrpcEndpointContext& endpoint, HealthService& service);

}  // namespace clothstream::endpoint
