// SPDX-License-Identifier: MIT
// Calls of clothstream.v1.ClothStream.
#pragma once

#include <boost/asio/thread_pool.hpp>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/endpoint/grpc/call.h"

namespace clothstream::endpoint {

// Join is raw, since each message is serialised once for all its receivers.
using Service = v1::ClothStream::WithRawMethod_Join<
    v1::ClothStream::WithAsyncMethod_ListScenes<v1::ClothStream::WithAsyncMethod_GetScene<
        v1::ClothStream::WithAsyncMethod_CreateScene<v1::ClothStream::WithAsyncMethod_DeleteScene<
            v1::ClothStream::WithAsyncMethod_ControlScene<v1::ClothStream::WithAsyncMethod_StartRecording<
                v1::ClothStream::WithAsyncMethod_StopRecording<v1::ClothStream::WithAsyncMethod_Authenticate<
                    v1::ClothStream::WithAsyncMethod_CreatePairingCode<
                        v1::ClothStream::WithAsyncMethod_ListBans<
                            v1::ClothStream::WithAsyncMethod_LiftBan<v1::ClothStream::Service>>>>>>>>>>>>;

// Answers all calls of the service while the endpoint is open. Calls that may take long run on `slowCalls`.
void offerService(GrpcEndpointContext& endpoint, Service& service, boost::asio::thread_pool& slowCalls);

}  // namespace clothstream::endpoint
