// SPDX-License-Identifier: MIT
#include "server/rpc/service.h"

#include <utility>

#include <boost/asio/post.hpp>

#include "server/rpc/join_stream.h"
#include "server/rpc/unary_call.h"
#include "server/stream/scene_server.h"

namespace clothstream::rpc {

void offerService(DoorContext& door, Service& service, boost::asio::thread_pool& questions) {
  stream::SceneServer& server = door.server;
  offer(door, service, &Service::RequestListScenes,
        [&server](const auto&, auto answer) { answer(server.listScenes()); });
  // A scene may have a mesh of millions of vertices in it.
  offer(door, service, &Service::RequestGetScene, [&server, &questions](const auto& request, auto answer) {
    boost::asio::post(questions,
                      [&server, request, answer = std::move(answer)] { answer(server.getScene(request)); });
  });
  offer(door, service, &Service::RequestCreateScene,
        [&server](const auto& request, auto answer) { server.createScene(request, std::move(answer)); });
  offer(door, service, &Service::RequestDeleteScene,
        [&server](const auto& request, auto answer) { server.deleteScene(request, std::move(answer)); });
  offer(door, service, &Service::RequestControlScene,
        [&server](const auto& request, auto answer) { answer(server.controlScene(request)); });
  offer(door, service, &Service::RequestStartRecording,
        [&server](const auto& request, auto answer) { server.startRecording(request, std::move(answer)); });
  offer(door, service, &Service::RequestStopRecording,
        [&server](const auto& request, auto answer) { server.stopRecording(request, std::move(answer)); });
  await<JoinStream>(door, service);
}

}  // namespace clothstream::rpc
