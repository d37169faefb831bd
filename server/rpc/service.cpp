// SPDX-License-Identifier: MIT
#include "server/rpc/service.h"

#include <utility>

#include "server/rpc/status.h"
#include "server/stream/scene_server.h"

namespace clothstream::rpc {
namespace {

// Ends a call with what the server answered.
template <typename Response>
void finish(grpc::ServerUnaryReactor* reactor, Response* response, tl::expected<Response, v1::Error> answer) {
  if (answer) *response = std::move(*answer);
  reactor->Finish(answer ? grpc::Status::OK : statusOf(answer.error()));
}

}  // namespace

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
  finish(reactor, response, server_.getScene(*request));
  return reactor;
}

grpc::ServerUnaryReactor* Service::CreateScene(grpc::CallbackServerContext* context,
                                               const v1::CreateSceneRequest* request,
                                               v1::CreateSceneResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  server_.createScene(*request, [=](auto answer) { finish(reactor, response, std::move(answer)); });
  return reactor;
}

grpc::ServerUnaryReactor* Service::DeleteScene(grpc::CallbackServerContext* context,
                                               const v1::DeleteSceneRequest* request,
                                               v1::DeleteSceneResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  server_.deleteScene(*request, [=](auto answer) { finish(reactor, response, std::move(answer)); });
  return reactor;
}

grpc::ServerUnaryReactor* Service::ControlScene(grpc::CallbackServerContext* context,
                                                const v1::ControlSceneRequest* request,
                                                v1::ControlSceneResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  finish(reactor, response, server_.controlScene(*request));
  return reactor;
}

grpc::ServerUnaryReactor* Service::StartRecording(grpc::CallbackServerContext* context,
                                                  const v1::StartRecordingRequest* request,
                                                  v1::StartRecordingResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  server_.startRecording(*request, [=](auto answer) { finish(reactor, response, std::move(answer)); });
  return reactor;
}

grpc::ServerUnaryReactor* Service::StopRecording(grpc::CallbackServerContext* context,
                                                 const v1::StopRecordingRequest* request,
                                                 v1::StopRecordingResponse* response) {
  grpc::ServerUnaryReactor* const reactor = context->DefaultReactor();
  server_.stopRecording(*request, [=](auto answer) { finish(reactor, response, std::move(answer)); });
  return reactor;
}

grpc::ServerBidiReactor<grpc::ByteBuffer, grpc::ByteBuffer>* Service::Join(
    grpc::CallbackServerContext* context) {
  return streams_.open(*context);
}

}  // namespace clothstream::rpc
