// SPDX-License-Identifier: MIT
// Calls of grpc.reflection.v1alpha.ServerReflection, by which tools learn the messages of the services.
#pragma once

#include "grpc/reflection/v1alpha/reflection.grpc.pb.h"
#include "server/endpoint/grpc/call.h"

namespace clothstream::endpoint {

// gRPC's own reflection has threads that answer without limits.
using ReflectionService = grpc::reflection::v1alpha::ServerReflection::WithAsyncMethod_ServerReflectionInfo<
    grpc::reflection::v1alpha::ServerReflection::Service>;

// Answers all calls of the service while the endpoint is open, of peers that the server identifies. Streams
// count like health watches and end after GrpcEndpointContext::answerTimeout. Each request counts like a call
// that reads a scene (CallRate). The next one is read when its answer was sent.
void offerReflection(GrpcEndpointContext& endpoint, ReflectionService& service);

// Answer to one request. Describes only files of the services: ClothStream, health and reflection.
grpc::reflection::v1alpha::ServerReflectionResponse reflectionOf(
    const grpc::reflection::v1alpha::ServerReflectionRequest& request);

}  // namespace clothstream::endpoint
