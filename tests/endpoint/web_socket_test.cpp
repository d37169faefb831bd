// SPDX-License-Identifier: MIT
// Tests of the WebSocket endpoint only: handshake, close frames, detection of clients that vanish.
#include <chrono>
#include <memory>

#include <gmock/gmock.h>

#include "server/endpoint/web/web_endpoint.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/web_client.h"

namespace clothstream::tests {
namespace {

using testing::ThrowsMessage;

class WebSocketEndpoint : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (!IsSkipped()) open({});
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }
  void open(endpoint::WebEndpointOptions options) {
    endpoint_.reset();
    options.port = 0;
    endpoint_ = std::make_unique<endpoint::WebEndpoint>(server(), options);
  }
  std::uint16_t port() const { return endpoint_->port(); }
  Joined join() const { return Joined(std::make_unique<WebSocketClient>(port())); }

  std::unique_ptr<endpoint::WebEndpoint> endpoint_;
};

WebSocketClient& socketOf(const Joined& joined) {
  return dynamic_cast<WebSocketClient&>(*joined.client);
}

TEST_F(WebSocketEndpoint, AcceptsSubprotocolThatClientOffers) {
  WebSocketClient::Handshake handshake;
  handshake.subprotocol = "other, clothstream.v1";
  EXPECT_EQ(WebSocketClient(port(), handshake).response()[http::field::sec_websocket_protocol],
            "clothstream.v1");
  EXPECT_EQ(WebSocketClient(port()).response().count(http::field::sec_websocket_protocol), 0U);
}

TEST_F(WebSocketEndpoint, RefusesPagesOfOtherOriginsUnlessAllowed) {
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

// The page of a name whose address is changed to this server's, which is of the same origin.
TEST_F(WebSocketEndpoint, RefusesNamesThatItDoesNotHave) {
  endpoint::WebEndpointOptions options;
  options.publicNames = {"cloth.example.org"};
  open(options);
  const auto connect = [&](const std::string& name) {
    WebSocketClient::Handshake handshake;
    handshake.host = name + ":" + std::to_string(port());
    handshake.origin = "http://" + handshake.host;
    WebSocketClient(port(), handshake);
  };
  EXPECT_NO_THROW(connect("localhost"));
  EXPECT_NO_THROW(connect("cloth.example.org"));
  EXPECT_THAT([&] { connect("evil.example"); }, ThrowsMessage<ClientError>("declined with 421"));
}

TEST_F(WebSocketEndpoint, ClosesOnTextMessage) {
  Joined other = join();
  Joined client = join();
  socketOf(client).sendText("{\"hello\": {}}");
  EXPECT_EQ(client.seeEnd().code, websocket::close_code::unknown_data);
  EXPECT_TRUE(other.see(5));
}

TEST_F(WebSocketEndpoint, SurvivesUnmaskedFrame) {
  Joined other = join();
  HttpClient raw(port());
  const Response upgraded =
      raw.get("/stream",
              "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
  ASSERT_EQ(upgraded.result(), http::status::switching_protocols);
  raw.send(
      std::string("\x82\x05hello", 7));  // RFC 6455 5.1: the server disconnects a client that does not mask
  EXPECT_TRUE(other.see(5));
}

TEST_F(WebSocketEndpoint, ClosesAfterTooManyFramesOfAnyKind) {
  Joined other = join();
  const std::string kinds[] = {
      std::string("\x8a\x80mask", 6),   // pongs
      std::string("\x89\x80mask", 6),   // pings
      std::string("\x00\x80mask", 6),   // empty fragments
      std::string("\x8a\x81maskx", 7),  // pongs with payload
  };
  for (const std::string& kind : kinds) {
    HttpClient raw(port());
    const Response upgraded =
        raw.get("/stream",
                "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
    ASSERT_EQ(upgraded.result(), http::status::switching_protocols);
    std::string flood = kind[0] == 0 ? std::string("\x02\x80mask", 6) : "";  // the message of the fragments
    // Too many even if reading them takes some seconds. The server does not read all of them, so the rest
    // must fit into the buffers of the connection.
    for (int i = 0; i < 20'000; ++i) flood += kind;
    raw.send(flood);
    EXPECT_TRUE(raw.receives("\x03\xf0too many WebSocket frames")) << kind;
  }
  EXPECT_TRUE(other.see(5));
}

TEST_F(WebSocketEndpoint, RemovesColliderOfClientThatHalfCloses) {
  Joined watcher = join();
  Joined owner = join();
  const std::uint64_t id = owner.viewer.welcome.participant_id();
  owner.client->send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  socketOf(owner).shutdownSend();
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

// A page that is closed may have been reloaded.
TEST_F(WebSocketEndpoint, KeepsPlaceOfClosedPage) {
  Joined watcher = join();
  const auto presenceAfter = [&](websocket::close_code code) {
    Joined page = join();
    socketOf(page).close(code);
    watcher.seeUntil([&] {
      const v1::Presence& presence = watcher.viewer.last.presence();
      return presence.participant().id() == page.viewer.welcome.participant_id() &&
             presence.kind() != v1::PRESENCE_KIND_JOINED;
    });
    return watcher.viewer.last.presence().kind();
  };
  EXPECT_EQ(presenceAfter(websocket::close_code::going_away), v1::PRESENCE_KIND_DISCONNECTED);
  EXPECT_EQ(presenceAfter(static_cast<websocket::close_code>(4001)), v1::PRESENCE_KIND_DISCONNECTED);
  EXPECT_EQ(presenceAfter(websocket::close_code::normal), v1::PRESENCE_KIND_LEFT);
  EXPECT_EQ(presenceAfter(websocket::close_code::none), v1::PRESENCE_KIND_LEFT);
}

// A client whose machine or network has failed neither reads nor answers pings, and its socket stays open.
TEST_F(WebSocketEndpoint, DetectsVanishedClientWithinTenSeconds) {
  Joined watcher = join();
  Joined vanished = join();
  const std::uint64_t id = vanished.viewer.welcome.participant_id();
  vanished.client->send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  const auto from = std::chrono::steady_clock::now();
  EXPECT_TRUE(watcher.seeUntil([&] {
    const v1::Presence& presence = watcher.viewer.last.presence();
    return presence.kind() == v1::PRESENCE_KIND_DISCONNECTED && presence.participant().id() == id;
  }));
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(10));
  // The participant keeps its place, but its collider goes.
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

TEST_F(WebSocketEndpoint, KeepsSilentClientThatAnswersPings) {
  Joined client = join();
  // Longer than the time after which a vanished client is disconnected.
  EXPECT_FALSE(socketOf(client).closesWithin(std::chrono::seconds(6)));
}

// A client that does not read cannot keep the endpoint open.
TEST_F(WebSocketEndpoint, ClosesWithinThreeSecondsThoughClientDoesNotRead) {
  Joined client = join();
  const auto from = std::chrono::steady_clock::now();
  endpoint_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - from, std::chrono::seconds(3));
}

}  // namespace
}  // namespace clothstream::tests
