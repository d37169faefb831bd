// SPDX-License-Identifier: MIT
// Whoever comes through one endpoint shares the scene with those who came through the other.
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/endpoint/web/web_endpoint.h"
#include "tests/endpoint/rpc_client.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/web_client.h"
#include "tests/serving/allocated_bytes.h"

namespace clothstream::tests {
namespace {

class BothEndpoints : public EndpointTest {
 protected:
  void SetUp() override {
    EndpointTest::SetUp();
    if (IsSkipped()) return;
    endpoint::GrpcEndpointOptions rpcOptions;
    rpcOptions.port = 0;
    endpoint::WebEndpointOptions webOptions;
    webOptions.port = 0;
    grpcEndpoint = std::make_unique<endpoint::GrpcEndpoint>(server(), rpcOptions);
    webEndpoint = std::make_unique<endpoint::WebEndpoint>(server(), webOptions);
  }
  void TearDown() override {
    grpcEndpoint.reset();
    webEndpoint.reset();
    EndpointTest::TearDown();
  }

  std::unique_ptr<endpoint::GrpcEndpoint> grpcEndpoint;
  std::unique_ptr<endpoint::WebEndpoint> webEndpoint;
};

template <class Mover, class Watcher>
void expectColliderIsSeen(Mover& mover, Watcher& watcher) {
  Viewer moved, watched;
  mover.send(hello());
  watcher.send(hello());
  ASSERT_TRUE(mover.watch(moved, [&] { return moved.frames > 0; }));
  ASSERT_TRUE(watcher.watch(watched, [&] { return watched.frames > 0; }));
  const std::uint64_t id = moved.welcome.participant_id();
  EXPECT_NE(id, watched.welcome.participant_id());
  mover.send(colliderPose(0.5f));
  ASSERT_TRUE(watcher.watch(watched, [&] { return watched.colliderOf(id).has_value(); }));
  EXPECT_FLOAT_EQ(watched.colliderOf(id)->position().x(), 0.5f);
  mover.send(colliderPose(std::nullopt));
  EXPECT_TRUE(watcher.watch(watched, [&] { return !watched.colliderOf(id).has_value(); }));
}

TEST_F(BothEndpoints, APoseThroughGrpcIsSeenThroughWebSocket) {
  RpcStream mover(grpcEndpoint->port());
  WebSocketClient watcher(webEndpoint->port());
  expectColliderIsSeen(mover, watcher);
}

TEST_F(BothEndpoints, APoseThroughWebSocketIsSeenThroughGrpc) {
  WebSocketClient mover(webEndpoint->port());
  RpcStream watcher(grpcEndpoint->port());
  expectColliderIsSeen(mover, watcher);
}

// Of who joins, says much, and never reads: its own part of what is measured included.
template <class Client>
double costOfNotReading(std::uint16_t port) {
  constexpr int kClients = 4, kRounds = 60;
  const double before = allocatedBytes();
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<Client>(port));
    clients.back()->send(hello("large"));
  }
  for (int round = 0; round < kRounds; ++round) {
    for (const auto& client : clients) {
      client->send(ping());
      client->send(colliderPose(0.01f * static_cast<float>(round)));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(35));  // a tick
  }
  return (allocatedBytes() - before) / kClients;
}

TEST_F(BothEndpoints, WhoDoesNotReadCostsAtMostWhatIsPromised) {
  // So that what the scene takes is there.
  Viewer seen;
  RpcStream first(grpcEndpoint->port());
  first.send(hello("large"));
  ASSERT_TRUE(first.watch(seen, [&] { return seen.frames > 0; }));
  const double rpc = costOfNotReading<RpcStream>(grpcEndpoint->port());
  const double web = costOfNotReading<WebSocketClient>(webEndpoint->port());
  std::printf("a client that does not read: %.0f KiB over gRPC, %.0f KiB over WebSocket\n", rpc / 1024,
              web / 1024);
  EXPECT_LT(rpc, kMostBytesAClient);
  EXPECT_LT(web, kMostBytesAClient);
}

// Serialised; of who comes back, with the token of its Welcome.
std::string helloWith(const std::string& token) {
  v1::ClientMessage message;
  message.ParseFromString(hello());
  message.mutable_hello()->set_resume_token(token);
  return message.SerializeAsString();
}

// Joins through `endpoint`, and hears what becomes of whoever goes as `go` does.
template <class Client>
v1::Presence presenceAfter(std::uint16_t port, RpcStream& watcher, Viewer& watched,
                           const std::function<void(Client&)>& go, Viewer& gone) {
  Client client(port);
  client.send(hello());
  EXPECT_TRUE(client.watch(gone, [&] { return gone.frames > 0; }));
  go(client);
  EXPECT_TRUE(watcher.watch(watched, [&] {
    const v1::Presence& told = watched.last.presence();
    return told.participant().id() == gone.welcome.participant_id() &&
           (told.kind() == v1::PRESENCE_KIND_LEFT || told.kind() == v1::PRESENCE_KIND_DISCONNECTED);
  }));
  return watched.last.presence();
}

// A goodbye in the endpoint's way is one; anything else is a connection that was lost, and through either
// endpoint its participant comes back.
TEST_F(BothEndpoints, WhoSaysGoodbyeHasLeftAndWhoIsCutOffComesBack) {
  RpcStream watcher(grpcEndpoint->port());
  Viewer watched;
  watcher.send(hello());
  ASSERT_TRUE(watcher.watch(watched, [&] { return watched.frames > 0; }));
  Viewer left, closed, cancelled, reset;
  EXPECT_EQ(presenceAfter<RpcStream>(
                grpcEndpoint->port(), watcher, watched, [](RpcStream& client) { client.sendDone(); }, left)
                .reason(),
            v1::LEAVE_REASON_LEFT);
  EXPECT_EQ(
      presenceAfter<WebSocketClient>(
          webEndpoint->port(), watcher, watched, [](WebSocketClient& client) { client.close(); }, closed)
          .reason(),
      v1::LEAVE_REASON_LEFT);
  EXPECT_EQ(presenceAfter<RpcStream>(
                grpcEndpoint->port(), watcher, watched, [](RpcStream& client) { client.cancel(); }, cancelled)
                .kind(),
            v1::PRESENCE_KIND_DISCONNECTED);
  EXPECT_EQ(presenceAfter<WebSocketClient>(
                webEndpoint->port(), watcher, watched, [](WebSocketClient& client) { client.reset(); }, reset)
                .kind(),
            v1::PRESENCE_KIND_DISCONNECTED);
  Viewer webViewer, rpcViewer;
  WebSocketClient web(webEndpoint->port());
  web.send(helloWith(cancelled.welcome.resume_token()));
  ASSERT_TRUE(web.watch(webViewer, [&] { return webViewer.frames > 0; }));
  EXPECT_TRUE(webViewer.welcome.resumed());
  EXPECT_EQ(webViewer.welcome.participant_id(), cancelled.welcome.participant_id());
  RpcStream rpc(grpcEndpoint->port());
  rpc.send(helloWith(reset.welcome.resume_token()));
  ASSERT_TRUE(rpc.watch(rpcViewer, [&] { return rpcViewer.frames > 0; }));
  EXPECT_EQ(rpcViewer.welcome.participant_id(), reset.welcome.participant_id());
}

// The same tick is the same packet, whichever endpoint it went through.
TEST_F(BothEndpoints, BothSeeTheSameFrames) {
  WebSocketClient web(webEndpoint->port());
  RpcStream rpc(grpcEndpoint->port());
  Viewer webViewer, rpcViewer;
  web.send(hello());
  rpc.send(hello());
  ASSERT_TRUE(web.watch(webViewer, [&] { return webViewer.frames > 0; }));
  ASSERT_TRUE(rpc.watch(rpcViewer, [&] { return rpcViewer.frames > 0; }));
  for (int common = 0; common < 5;) {
    if (webViewer.tick() < rpcViewer.tick()) {
      ASSERT_TRUE(web.watch(webViewer, [&] { return webViewer.tick() >= rpcViewer.tick(); }));
    } else if (rpcViewer.tick() < webViewer.tick()) {
      ASSERT_TRUE(rpc.watch(rpcViewer, [&] { return rpcViewer.tick() >= webViewer.tick(); }));
    } else {
      EXPECT_EQ(webViewer.frame.SerializeAsString(), rpcViewer.frame.SerializeAsString());
      ++common;
      const std::uint64_t tick = webViewer.tick();
      ASSERT_TRUE(web.watch(webViewer, [&] { return webViewer.tick() > tick; }));
    }
  }
}

}  // namespace
}  // namespace clothstream::tests
