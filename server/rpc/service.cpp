// SPDX-License-Identifier: MIT
#include "server/rpc/service.h"

#include <utility>

#include "server/rpc/status.h"
#include "server/stream/scene_server.h"

namespace clothstream::rpc {

grpc::ServerUnaryReactor* Service::ListScenes(grpc::CallbackServerContext* context,
                                              const v1::ListScenesRequest*,
                                              v1::ListScenesResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  *response = server_.listScenes();
  reactor->Finish(grpc::Status::OK);
  return reactor;
}

grpc::ServerUnaryReactor* Service::GetScene(grpc::CallbackServerContext* context,
                                            const v1::GetSceneRequest* request,
                                            v1::GetSceneResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  auto answer = server_.getScene(*request);
  if (answer) *response = std::move(*answer);
  reactor->Finish(answer ? grpc::Status::OK : statusOf(answer.error()));
  return reactor;
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Service::Join(
    grpc::CallbackServerContext* context) {
  return streams_.open(*context);
}

}  // namespace clothstream::rpc
