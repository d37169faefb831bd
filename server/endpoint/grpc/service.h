// SPDX-License-Identifier: MIT
// The calls of clothstream.v1.ClothStream.
#pragma once

#include <boost/asio/thread_pool.hpp>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/endpoint/grpc/call.h"

namespace clothstream::endpoint {

// Join is raw: its messages are already serialised, once for all who get them.
using Service = v1::ClothStream::WithRawMethod_Join<
    v1::ClothStream::WithAsyncMethod_ListScenes<v1::ClothStream::WithAsyncMethod_GetScene<
        v1::ClothStream::WithAsyncMethod_CreateScene<v1::ClothStream::WithAsyncMethod_DeleteScene<
            v1::ClothStream::WithAsyncMethod_ControlScene<v1::ClothStream::WithAsyncMethod_StartRecording<
                v1::ClothStream::WithAsyncMethod_StopRecording<v1::ClothStream::Service>>>>>>>>;

// Answers all its calls, for as long as the endpoint is open; on a thread of `questions` where that may take
// long.
void offerService(GrpcEndpointContext& endpoint, Service& service, boost::asio::thread_pool& questions);

}  // namespace clothstream::endpoint
