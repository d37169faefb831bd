// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/service.h"

#include <utility>

#include <boost/asio/post.hpp>

#include "server/endpoint/grpc/caller.h"
#include "server/endpoint/grpc/join_stream.h"
#include "server/endpoint/grpc/unary_call.h"
#include "server/hosting/answers.h"
#include "server/hosting/scene_server.h"

namespace clothstream::endpoint {
namespace {

using hosting::Identity;

template <typename Response>
tl::expected<Response, v1::Error> toAnswer(messages::Result<Response> result) {
  if (!result) return tl::unexpected(hosting::toMessage(result.error()));
  return std::move(*result);
}

// Calls about identities and bans.
void offerIdentity(GrpcEndpointContext& endpoint, Service& service) {
  hosting::SceneServer& server = endpoint.server;
  offerToAll(endpoint, service, &Service::RequestAuthenticate,
             [&server](const auto& request, const grpc::ServerContext& context, auto answer) {
               v1::AuthenticateResponse response;
               const auto identity = server.authentication.authenticate(request, addressKeyOf(context.peer()),
                                                                        schedule::Clock::now(), response);
               if (!identity) return answer(tl::unexpected(hosting::toMessage(identity.error())));
               answer(std::move(response));
             });
  offer(endpoint, service, &Service::RequestCreatePairingCode,
        [&server](const auto& request, const Identity& by, auto answer) {
          answer(toAnswer(server.authentication.createPairingCode(by, request, schedule::Clock::now())));
        });
  offer(endpoint, service, &Service::RequestListBans,
        [&server](const auto& request, const Identity& by, auto answer) {
          answer(server.unaryCalls.listBans(request, by));
        });
  offer(endpoint, service, &Service::RequestLiftBan,
        [&server](const auto& request, const Identity& by, auto answer) {
          answer(server.unaryCalls.liftBan(request, by));
        });
}

}  // namespace

void offerService(GrpcEndpointContext& endpoint, Service& service, boost::asio::thread_pool& slowCalls) {
  hosting::SceneServer& server = endpoint.server;
  offer(
      endpoint, service, &Service::RequestListScenes,
      [&server](const auto&, const Identity& by, auto answer) { answer(server.unaryCalls.listScenes(by)); });
  // Slow, since a scene may contain a mesh of millions of vertices.
  offer(
      endpoint, service, &Service::RequestGetScene,
      [&server, &slowCalls](const auto& request, const Identity& by, auto answer) {
        auto wanted = answer.wanted();
        boost::asio::post(slowCalls,
                          [&server, request, by, wanted = std::move(wanted), answer = std::move(answer)] {
                            if (!wanted()) return;  // the client has cancelled the call
                            answer(server.unaryCalls.getScene(request, by));
                          });
      },
      CallRate::kSceneCost);
  offer(
      endpoint, service, &Service::RequestCreateScene,
      [&server](const auto& request, const Identity& by, auto answer) {
        auto wanted = answer.wanted();
        server.unaryCalls.createScene(request, std::move(answer), by, std::move(wanted));
      },
      CallRate::kSceneCost);
  offer(endpoint, service, &Service::RequestDeleteScene,
        [&server](const auto& request, const Identity& by, auto answer) {
          server.unaryCalls.deleteScene(request, std::move(answer), by);
        });
  offer(endpoint, service, &Service::RequestControlScene,
        [&server](const auto& request, const Identity& by, auto answer) {
          answer(server.unaryCalls.controlScene(request, by));
        });
  offer(endpoint, service, &Service::RequestStartRecording,
        [&server](const auto& request, const Identity& by, auto answer) {
          server.unaryCalls.startRecording(request, std::move(answer), by);
        });
  offer(endpoint, service, &Service::RequestStopRecording,
        [&server](const auto& request, const Identity& by, auto answer) {
          server.unaryCalls.stopRecording(request, std::move(answer), by);
        });
  offerIdentity(endpoint, service);
  await<JoinStream>(endpoint, service);
}

}  // namespace clothstream::endpoint
