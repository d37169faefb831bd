// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/service.h"

#include <utility>

#include <boost/asio/post.hpp>

#include "server/endpoint/grpc/join_stream.h"
#include "server/endpoint/grpc/unary_call.h"
#include "server/hosting/scene_server.h"

namespace clothstream::endpoint {

void offerService(GrpcEndpointContext& endpoint, Service& service, boost::asio::thread_pool& slowCalls) {
  hosting::SceneServer& server = endpoint.server;
  offer(endpoint, service, &Service::RequestListScenes,
        [&server](const auto&, auto answer) { answer(server.listScenes()); });
  // Slow, since a scene may contain a mesh of millions of vertices.
  offer(
      endpoint, service, &Service::RequestGetScene,
      [&server, &slowCalls](const auto& request, auto answer) {
        boost::asio::post(
            slowCalls, [&server, request, answer = std::move(answer)] { answer(server.getScene(request)); });
      },
      CallRate::kSceneCost);
  offer(
      endpoint, service, &Service::RequestCreateScene,
      [&server](const auto& request, auto answer) { server.createScene(request, std::move(answer)); },
      CallRate::kSceneCost);
  offer(endpoint, service, &Service::RequestDeleteScene,
        [&server](const auto& request, auto answer) { server.deleteScene(request, std::move(answer)); });
  offer(endpoint, service, &Service::RequestControlScene,
        [&server](const auto& request, auto answer) { answer(server.controlScene(request)); });
  offer(endpoint, service, &Service::RequestStartRecording,
        [&server](const auto& request, auto answer) { server.startRecording(request, std::move(answer)); });
  offer(endpoint, service, &Service::RequestStopRecording,
        [&server](const auto& request, auto answer) { server.stopRecording(request, std::move(answer)); });
  await<JoinStream>(endpoint, service);
}

}  // namespace clothstream::endpoint
