// SPDX-License-Identifier: MIT
// The calls of clothstream.v1.ClothStream.
#pragma once

#include <grpcpp/support/server_callback.h>

#include "clothstream/v1/session.grpc.pb.h"
#include "server/rpc/join_streams.h"

namespace clothstream::rpc {

// Join is raw: its messages are already serialised, once for all who get them.
using ServiceBase =
    v1::ClothStream::WithRawCallbackMethod_Join<v1::ClothStream::WithCallbackMethod_ListScenes<
        v1::ClothStream::WithCallbackMethod_GetScene<v1::ClothStream::WithCallbackMethod_CreateScene<
            v1::ClothStream::WithCallbackMethod_DeleteScene<v1::ClothStream::WithCallbackMethod_ControlScene<
                v1::ClothStream::WithCallbackMethod_StartRecording<
                    v1::ClothStream::WithCallbackMethod_StopRecording<v1::ClothStream::Service>>>>>>>>;

class Service final : public ServiceBase {
 public:
  Service(stream::SceneServer& server, JoinStreams& streams) : server_(server), streams_(streams) {}

  grpc::ServerUnaryReactor* ListScenes(grpc::CallbackServerContext* context,
                                       const v1::ListScenesRequest* request,
                                       v1::ListScenesResponse* response) override;
  grpc::ServerUnaryReactor* GetScene(grpc::CallbackServerContext* context, const v1::GetSceneRequest* request,
                                     v1::GetSceneResponse* response) override;
  grpc::ServerUnaryReactor* CreateScene(grpc::CallbackServerContext* context,
                                        const v1::CreateSceneRequest* request,
                                        v1::CreateSceneResponse* response) override;
  grpc::ServerUnaryReactor* DeleteScene(grpc::CallbackServerContext* context,
                                        const v1::DeleteSceneRequest* request,
                                        v1::DeleteSceneResponse* response) override;
  grpc::ServerUnaryReactor* ControlScene(grpc::CallbackServerContext* context,
                                         const v1::ControlSceneRequest* request,
                                         v1::ControlSceneResponse* response) override;
  grpc::ServerUnaryReactor* StartRecording(grpc::CallbackServerContext* context,
                                           const v1::StartRecordingRequest* request,
                                           v1::StartRecordingResponse* response) override;
  grpc::ServerUnaryReactor* StopRecording(grpc::CallbackServerContext* context,
                                          const v1::StopRecordingRequest* request,
                                          v1::StopRecordingResponse* response) override;
  grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Join(
      grpc::CallbackServerContext* context) override;

 private:
  stream::SceneServer& server_;
  JoinStreams& streams_;
};

}  // namespace clothstream::rpc
