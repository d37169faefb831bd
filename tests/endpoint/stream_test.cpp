// SPDX-License-Identifier: MIT
// The stream over WebSocket, with peers good and bad.
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "server/endpoint/web/web_endpoint.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/web_client.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class StreamEndpoint : public EndpointTest {
 protected:
  void SetUp() override {
    EndpointTest::SetUp();
    if (!IsSkipped()) open({});
  }
  void TearDown() override {
    endpoint.reset();
    EndpointTest::TearDown();
  }
  void open(endpoint::WebEndpointOptions options) {
    endpoint.reset();
    options.port = 0;
    endpoint = std::make_unique<endpoint::WebEndpoint>(server(), options);
  }
  std::uint16_t port() const { return endpoint->port(); }

  std::unique_ptr<endpoint::WebEndpoint> endpoint;
};

// A peer that joined, and what it saw.
struct Joined {
  explicit Joined(std::uint16_t port, const std::string& scene = "") : socket(port) {
    socket.send(hello(scene));
    see(1);
  }
  // Sees `count` frames more; false when the server closes before.
  bool see(std::uint64_t count) {
    const std::uint64_t target = viewer.frames + count;
    return socket.watch(viewer, [&] { return viewer.frames >= target; });
  }
  bool seeUntil(const std::function<bool()>& done) { return socket.watch(viewer, done); }

  WebSocketClient socket;
  Viewer viewer;
};

TEST_F(StreamEndpoint, JoinsAndDecodesFrames) {
  Joined peer(port());
  EXPECT_EQ(peer.viewer.welcome.scene(), "small");
  EXPECT_EQ(peer.viewer.description.cloths(0).vertex_count(), 64U);
  const std::uint64_t first = peer.viewer.tick();
  EXPECT_TRUE(peer.see(10));
  EXPECT_GE(peer.viewer.tick(), first + 10);
  EXPECT_TRUE(peer.viewer.errors.empty());
}

TEST_F(StreamEndpoint, AnswersPings) {
  Joined peer(port());
  peer.socket.send(ping());
  EXPECT_TRUE(peer.seeUntil([&] { return peer.viewer.pongs == 1; }));
}

TEST_F(StreamEndpoint, ListsScenesBeforeJoining) {
  WebSocketClient socket(port());
  v1::ClientMessage question;
  question.set_request_id(5);
  question.mutable_list_scenes();
  socket.send(question.SerializeAsString());
  Viewer viewer;
  ASSERT_TRUE(socket.watch(viewer, [&] { return viewer.last.has_list_scenes(); }));
  EXPECT_EQ(viewer.last.request_id(), 5U);
  EXPECT_EQ(viewer.last.list_scenes().scenes_size(), 3);
}

TEST_F(StreamEndpoint, AgreesOnTheSubprotocolWhereItIsOffered) {
  WebSocketClient::Handshake handshake;
  handshake.subprotocol = "other, clothstream.v1";
  EXPECT_EQ(WebSocketClient(port(), handshake).response()[http::field::sec_websocket_protocol],
            "clothstream.v1");
  EXPECT_EQ(WebSocketClient(port()).response().count(http::field::sec_websocket_protocol), 0U);
}

TEST_F(StreamEndpoint, PagesOfOtherOriginsAreRefusedUnlessAllowed) {
  endpoint::WebEndpointOptions options;
  options.allowedOrigins = {"https://friend.example"};
  open(options);
  const auto connect = [&](const std::string& origin) {
    WebSocketClient::Handshake handshake;
    handshake.origin = origin;
    WebSocketClient(port(), handshake);
  };
  EXPECT_NO_THROW(connect("http://127.0.0.1:" + std::to_string(port())));
  EXPECT_NO_THROW(connect("https://friend.example"));
  for (const char* origin :
       {"http://evil.example", "https://friend.example.evil.example", "http://127.0.0.1", "null"})
    EXPECT_THAT([&] { connect(origin); }, ThrowsMessage<ClientError>("declined with 403")) << origin;
}

TEST_F(StreamEndpoint, AnUnknownSceneIsNamedInTheErrorAndInTheCloseReason) {
  WebSocketClient socket(port());
  socket.send(hello("nowhere"));
  Viewer viewer;
  EXPECT_FALSE(socket.watch(viewer, [] { return false; }));
  ASSERT_EQ(viewer.errors.size(), 1U);
  EXPECT_EQ(viewer.errors[0].code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(viewer.errors[0].text(), HasSubstr("nowhere"));
  EXPECT_EQ(socket.closeReason().code, websocket::close_code::policy_error);
  EXPECT_THAT(std::string(socket.closeReason().reason.c_str()), HasSubstr("nowhere"));
}

TEST_F(StreamEndpoint, ATextMessageCloses) {
  Joined other(port());
  Joined peer(port());
  peer.socket.send("{\"hello\": {}}", false);
  EXPECT_FALSE(peer.seeUntil([] { return false; }));
  EXPECT_EQ(peer.socket.closeReason().code, websocket::close_code::unknown_data);
  EXPECT_TRUE(other.see(5));
}

TEST_F(StreamEndpoint, AMessageOverTheLimitCloses) {
  Joined other(port());
  Joined peer(port());
  peer.socket.send(garbage(64 * 1024 + 1));
  EXPECT_FALSE(peer.seeUntil([] { return false; }));
  EXPECT_EQ(peer.socket.closeReason().code, websocket::close_code::too_big);
  EXPECT_TRUE(other.see(5));
}

TEST_F(StreamEndpoint, GarbageIsAnsweredByAnErrorToItsSenderAlone) {
  Joined other(port());
  Joined peer(port());
  peer.socket.send(garbage(500));
  EXPECT_TRUE(peer.seeUntil([&] { return !peer.viewer.errors.empty(); }));
  EXPECT_EQ(peer.viewer.errors[0].code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_TRUE(other.see(5));
  EXPECT_TRUE(other.viewer.errors.empty());
}

TEST_F(StreamEndpoint, FramesOfWebSocketThatBreakItsRulesClose) {
  Joined other(port());
  HttpClient raw(port());
  const Response upgraded =
      raw.get("/stream",
              "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
  ASSERT_EQ(upgraded.result(), http::status::switching_protocols);
  raw.send(std::string("\x82\x05hello", 7));  // RFC 6455 5.1: a client that does not mask is disconnected
  EXPECT_TRUE(other.see(5));
}

TEST_F(StreamEndpoint, APeersColliderIsSeenByOthersAndVanishesWithIt) {
  Joined watcher(port());
  auto leaver = std::make_unique<Joined>(port());
  const std::uint64_t id = leaver->viewer.welcome.participant_id();
  leaver->socket.send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  EXPECT_FLOAT_EQ(watcher.viewer.colliderOf(id)->position().x(), 0.25f);
  leaver->socket.reset();
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

TEST_F(StreamEndpoint, AHalfClosedPeerHasLeft) {
  Joined watcher(port());
  Joined leaver(port());
  const std::uint64_t id = leaver.viewer.welcome.participant_id();
  leaver.socket.send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  leaver.socket.shutdownSend();
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

// A peer whose machine or network is gone neither reads nor answers pings, and its socket stays open.
TEST_F(StreamEndpoint, AVanishedPeerIsFoundWithinFiveSeconds) {
  Joined watcher(port());
  Joined vanished(port());
  const std::uint64_t id = vanished.viewer.welcome.participant_id();
  vanished.socket.send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  const auto from = std::chrono::steady_clock::now();
  EXPECT_TRUE(watcher.seeUntil([&] {
    const v1::Presence& told = watcher.viewer.last.presence();
    return told.kind() == v1::PRESENCE_KIND_DISCONNECTED && told.participant().id() == id;
  }));
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(5));
  // Its place is held, but what it had vanishes.
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

TEST_F(StreamEndpoint, ASilentPeerThatAnswersPingsStays) {
  Joined peer(port());
  EXPECT_FALSE(
      peer.socket.closesWithin(std::chrono::seconds(6)));  // beyond the time after which it would be gone
}

// While one peer does not read, others see every frame; when it reads again, what waited for it is at most
// what it had left unacknowledged, and the next frame is a fresh one.
TEST_F(StreamEndpoint, ASlowReaderLosesFramesAndDelaysNobody) {
  Joined other(port());
  Joined slow(port());
  const std::uint64_t stoppedAt = slow.viewer.tick();
  for (std::uint64_t ticks = 15; ticks <= 60; ticks += 15) {
    ASSERT_TRUE(other.seeUntil([&] { return other.viewer.tick() >= stoppedAt + ticks; }));
    slow.socket.send(ping());  // or it would count as vanished
  }
  const std::uint64_t now = other.viewer.tick();
  std::uint64_t stale = 0;
  EXPECT_TRUE(slow.seeUntil([&] {
    if (slow.viewer.last.has_frame() && slow.viewer.tick() < now) ++stale;
    return slow.viewer.tick() >= now;
  }));
  EXPECT_LE(stale, 6U);  // two, and one more for each 33 ms of a round trip on a busy machine
  EXPECT_TRUE(slow.see(10));
}

// The write in flight to a peer that does not read would last for ever.
TEST_F(StreamEndpoint, AnAbusivePeerThatDoesNotReadIsCutOff) {
  endpoint::WebEndpointOptions options;
  options.maxConnections = 2;
  open(options);
  WebSocketClient abusive(port(), {.receiveBufferBytes = 4096});
  abusive.send(hello("large"));
  ASSERT_TRUE(abusive.receive().has_value());
  Joined other(port());
  ASSERT_TRUE(other.see(10));  // by now the description is under way
  for (int i = 0; i < 100 && abusive.send(garbage(50)); ++i) {
  }
  const auto from = std::chrono::steady_clock::now();
  while (HttpClient(port()).get("/healthz").result() == http::status::service_unavailable &&
         std::chrono::steady_clock::now() < from + kPatience) {
  }
  // Two seconds after the fatal error, and before it would count as vanished.
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(4));
  EXPECT_TRUE(other.see(5));
}

TEST_F(StreamEndpoint, ManyPeersComeAndGo) {
  Joined watcher(port());
  for (int round = 0; round < 10; ++round) {
    std::vector<std::unique_ptr<Joined>> crowd;
    for (int i = 0; i < 5; ++i) crowd.push_back(std::make_unique<Joined>(port(), i % 2 ? "other" : ""));
    for (const auto& peer : crowd) peer->socket.reset();
    EXPECT_TRUE(watcher.see(1));
  }
  EXPECT_TRUE(watcher.see(5));
  EXPECT_TRUE(watcher.viewer.errors.empty());
}

TEST_F(StreamEndpoint, ClosingTheEndpointTellsEveryPeer) {
  Joined first(port()), second(port());
  std::thread closing([&] { endpoint.reset(); });
  for (Joined* peer : {&first, &second}) {
    EXPECT_FALSE(peer->seeUntil([] { return false; }));
    EXPECT_EQ(peer->socket.closeReason().code, websocket::close_code::going_away);
  }
  closing.join();
}

// A peer that does not read cannot hold the endpoint open.
TEST_F(StreamEndpoint, ClosesInTimeThoughAPeerDoesNotRead) {
  Joined peer(port());
  const auto from = std::chrono::steady_clock::now();
  endpoint.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(3));
}

TEST_F(StreamEndpoint, StoppingTheServerSaysSoAndCloses) {
  Joined peer(port());
  server().stop();
  EXPECT_FALSE(peer.seeUntil([] { return false; }));
  ASSERT_FALSE(peer.viewer.notices.empty());
  EXPECT_EQ(peer.viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
  EXPECT_EQ(peer.socket.closeReason().code, websocket::close_code::going_away);
}

}  // namespace
}  // namespace clothstream::tests
