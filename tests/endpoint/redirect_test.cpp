// SPDX-License-Identifier: MIT
// Native clients at two servers on one port: the first one, 127.0.0.2, names the second one, localhost.
#include <atomic>
#include <fstream>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/channel.h"
#include "clients/grpc/grpc_client.h"
#include "clients/websocket/web_socket_transport.h"
#include "server/delivery/envelope.h"
#include "server/endpoint/grpc/grpc_endpoint.h"
#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/tls/server_tls.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/support/eventually.h"

namespace clothstream::tests {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr const char* kFirst = "127.0.0.2";
constexpr const char* kFirstInHexadecimal = "0200007F";  // in /proc/net/tcp
constexpr const char* kSecond = "localhost";

// The second server is that of the fixture. The first one has only the scene "small".
class Redirects : public SmallServer, public ::testing::WithParamInterface<Endpoint> {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    model::Scene small = server().scenes.find("small")->definition();
    hosting::ServerOptions options;
    options.budget = {
        .sceneLoad = 1e9, .load = 1e9, .sceneMegabytes = 1e9, .megabytes = 1e9, .tickSeconds = 0};
    options.defaultScene = small.name;
    first_ = std::make_unique<hosting::SceneServer>(std::vector{std::move(small)}, std::move(options));
    first_->scenes.setOtherServers([](const std::string&) { return std::string(kSecond); });
  }
  void TearDown() override {
    closeEndpoints();
    first_.reset();
    SmallServer::TearDown();
  }

  // Without certificates the servers have no TLS.
  void listen(const std::shared_ptr<tls::ServerTls>& first = nullptr,
              const std::shared_ptr<tls::ServerTls>& second = nullptr) {
    closeEndpoints();
    if (GetParam() == Endpoint::grpc) {
      secondGrpc_ = std::make_unique<endpoint::GrpcEndpoint>(
          server(), endpoint::GrpcEndpointOptions{.port = 0, .tls = second});
      port_ = secondGrpc_->port();
      firstGrpc_ = std::make_unique<endpoint::GrpcEndpoint>(
          *first_, endpoint::GrpcEndpointOptions{.host = kFirst, .port = port_, .tls = first});
    } else {
      secondWeb_ = std::make_unique<endpoint::WebEndpoint>(
          server(), endpoint::WebEndpointOptions{.port = 0, .tls = second});
      port_ = secondWeb_->port();
      firstWeb_ = std::make_unique<endpoint::WebEndpoint>(
          *first_, endpoint::WebEndpointOptions{.host = kFirst, .port = port_, .tls = first});
    }
  }
  void closeEndpoints() {
    firstGrpc_.reset();
    secondGrpc_.reset();
    firstWeb_.reset();
    secondWeb_.reset();
  }

  std::string addressOf(const std::string& host, bool encrypted = false) const {
    return (encrypted ? "https://" : "") + host + ":" + std::to_string(port_);
  }
  ServerAddress first(bool encrypted = false) const { return addressOf(kFirst, encrypted); }

  tl::expected<std::unique_ptr<NativeClient>, Failure> join(const ServerAddress& address,
                                                            const std::string& scene) {
    NativeClientOptions options;
    options.scene = scene;
    options.joinTimeout = std::chrono::seconds(60);  // for sanitizers on a busy machine
    options.onLog = [this](LogLevel, const std::string& text) { log_ += text + "\n"; };
    return NativeClient::join(address, makeTransport(address), options,
                              [this](cs_client*, std::uint32_t events) {
                                if ((events & CS_EVENT_FRAME) != 0) ++frames_;
                                if ((events & CS_EVENT_RETURNED) != 0) ++returns_;
                                if ((events & CS_EVENT_ERROR) != 0) ++errors_;
                              });
  }
  std::unique_ptr<Transport> makeTransport(const ServerAddress& address) const {
    return GetParam() == Endpoint::grpc ? clothstream::makeGrpcTransport(address)
                                        : makeWebSocketTransport(address);
  }
  std::string refusal(const ServerAddress& address, const std::string& scene) {
    const auto joined = join(address, scene);
    if (joined) return "joined";
    EXPECT_EQ(joined.error().kind, Failure::Kind::refused);
    return joined.error().text;
  }
  bool streams() {
    const std::uint64_t wanted = frames_ + 5;
    return eventually([&] { return frames_ >= wanted; });
  }

  // Addresses of the clients with a TCP connection to the second server, as in /proc/net/tcp.
  std::set<std::string> clientsOfSecond() const {
    std::set<std::string> clients;
    for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
      std::ifstream file(table);
      std::string line, number, local, remote, state;
      std::getline(file, line);
      while (std::getline(file, line) && std::istringstream(line) >> number >> local >> remote >> state) {
        const bool isFirst = local.find(kFirstInHexadecimal) != std::string::npos;
        if (state == "01" && local.ends_with(fmt::format(":{:04X}", port_)) && !isFirst)
          clients.insert(remote);
      }
    }
    return clients;
  }

  // A certificate with these names. It is the only authority for firstTrusted().
  std::shared_ptr<tls::ServerTls> certificateFor(const std::vector<std::string>& names) const {
    return std::make_shared<tls::ServerTls>(
        [directory = keys_.path(), names] { return tls::selfSigned(directory, names); }, "");
  }
  ServerAddress firstTrusted() const {
    ServerAddress address = first(true);
    address.caFile = keys_.path() / "self.pem";
    return address;
  }

  std::atomic<std::uint64_t> frames_{0}, returns_{0}, errors_{0};
  std::string log_;  // written by the client's thread
  e2e::TemporaryDirectory keys_;
  std::unique_ptr<hosting::SceneServer> first_;
  std::unique_ptr<endpoint::GrpcEndpoint> firstGrpc_, secondGrpc_;
  std::unique_ptr<endpoint::WebEndpoint> firstWeb_, secondWeb_;
  std::uint16_t port_ = 0;
};

TEST(GrpcPeerTest, HasAddress) {
  EXPECT_EQ(addressIn("ipv4:192.0.2.1:50051"), "192.0.2.1");
  EXPECT_EQ(addressIn("ipv6:%5B2001:db8::1%5D:50051"), "2001:db8::1");
  EXPECT_EQ(addressIn("ipv6:[::1]:50051"), "::1");
  for (const char* other : {"", "unknown", "unix:/run/server", "dns:///cloth.example:443", "ipv4:"})
    EXPECT_EQ(addressIn(other), "") << other;
}

INSTANTIATE_TEST_SUITE_P(Transports, Redirects, ::testing::Values(Endpoint::grpc, Endpoint::web),
                         [](const auto& endpoint) {
                           return std::string(endpoint.param == Endpoint::grpc ? "Grpc" : "WebSocket");
                         });

TEST_P(Redirects, FirstJoinGoesToTheServerThatHasTheScene) {
  listen();
  auto joined = join(first(), "other");
  ASSERT_TRUE(joined) << joined.error().text;
  EXPECT_TRUE(streams());
  EXPECT_EQ(server().scenes.find("other")->subscribers.size(), 1u);
  EXPECT_EQ(errors_, 0u) << "the program sees no error";
  joined->reset();
  EXPECT_THAT(log_, HasSubstr("another server: connecting to " + addressOf(kSecond)));
  EXPECT_THAT(log_, HasSubstr("at " + addressOf(kSecond) + " as participant"));
}

// Datagrams go to the same address.
TEST_P(Redirects, TransportKnowsServerAddress) {
  listen();
  const auto transport = makeTransport(first());
  EXPECT_EQ(transport->serverAddress(), "");
  transport->connect("");
  EXPECT_TRUE(eventually([&] {
    transport->wait(std::chrono::milliseconds(1));
    return transport->hasOpened() && transport->serverAddress() == kFirst;
  })) << transport->serverAddress();
}

TEST_P(Redirects, ReportsTheServerThatRefuses) {
  listen();
  EXPECT_THAT(refusal(first(), "none"),
              AllOf(HasSubstr("The server at " + addressOf(kSecond) + " refuses"), HasSubstr("none")));
}

TEST_P(Redirects, JoinedClientFollowsCutOff) {
  listen();
  const auto joined = join(first(), "small");
  ASSERT_TRUE(joined) << joined.error().text;
  EXPECT_TRUE(streams());
  first_->scenes.find("small")->roster.close(
      delivery::error(v1::ERROR_CODE_CUT_OFF, "the scene has moved", true, 0, kSecond));
  EXPECT_TRUE(eventually([&] { return returns_ == 1; }));
  EXPECT_TRUE(streams());
  EXPECT_EQ(server().scenes.find("small")->subscribers.size(), 1u);
  EXPECT_FALSE((*joined)->ended());
}

TEST_P(Redirects, JoinedClientConnectsBeforeTheSceneMoves) {
  const auto key = certificateFor({kFirst, kSecond});
  listen(key, key);
  const auto joined = join(firstTrusted(), "small");
  ASSERT_TRUE(joined) << joined.error().text;
  ASSERT_THAT(clientsOfSecond(), IsEmpty());
  scene::LiveScene& scene = *first_->scenes.find("small");
  EXPECT_EQ(scene.subscribers.announceHere(delivery::moving(kSecond)), 1u);
  ASSERT_TRUE(eventually([&] { return clientsOfSecond().size() == 1; }));
  const auto prepared = clientsOfSecond();
  EXPECT_TRUE(streams()) << "the scene is still here";
  EXPECT_EQ(server().scenes.find("small")->subscribers.size(), 0u);
  scene.roster.close(delivery::error(v1::ERROR_CODE_CUT_OFF, "the scene has moved", true, 0, kSecond));
  EXPECT_TRUE(eventually([&] { return returns_ == 1; }));
  EXPECT_TRUE(streams());
  EXPECT_EQ(clientsOfSecond(), prepared) << "by the same connection";
}

TEST_P(Redirects, FailedPreparationDoesNotStopTheMove) {
  listen();
  const auto joined = join(first(), "small");
  ASSERT_TRUE(joined) << joined.error().text;
  scene::LiveScene& scene = *first_->scenes.find("small");
  scene.subscribers.announceHere(delivery::moving("nowhere.invalid"));
  EXPECT_TRUE(streams());
  scene.subscribers.announceHere(delivery::moving(kSecond));
  EXPECT_TRUE(streams());
  scene.roster.close(delivery::error(v1::ERROR_CODE_CUT_OFF, "the scene has moved", true, 0, kSecond));
  EXPECT_TRUE(eventually([&] { return returns_ == 1; }));
  EXPECT_TRUE(streams());
}

TEST_P(Redirects, TokenStaysOnThisMachineWithoutTls) {
  listen();
  ServerAddress address = first();
  address.token = "secret";
  EXPECT_THAT(refusal(address, "other"),
              AllOf(HasSubstr("The server at " + addressOf(kFirst) + " refuses"), Not(HasSubstr("secret"))));
}

TEST_P(Redirects, CertificateWithTheNewNameIsTrusted) {
  const auto both = certificateFor({kFirst, kSecond});
  listen(both, both);
  const auto joined = join(firstTrusted(), "other");
  ASSERT_TRUE(joined) << joined.error().text;
  EXPECT_TRUE(streams());
  EXPECT_EQ(server().scenes.find("other")->subscribers.size(), 1u);
}

TEST_P(Redirects, CertificateWithoutTheNewNameIsRefused) {
  const auto onlyFirst = certificateFor({kFirst, "elsewhere.example"});
  listen(onlyFirst, onlyFirst);
  const auto joined = join(firstTrusted(), "other");
  ASSERT_FALSE(joined);
  EXPECT_THAT(joined.error().text, HasSubstr(addressOf(kSecond, true)));
  EXPECT_EQ(server().scenes.find("other")->subscribers.size(), 0u);
  // The first server is trusted all the same.
  EXPECT_TRUE(join(firstTrusted(), "small"));
}

TEST_P(Redirects, FingerprintHoldsForTheNewServerToo) {
  const auto known = certificateFor({"elsewhere.example"});
  listen(known, known);
  ServerAddress address = first(true);
  address.fingerprint = known->fingerprint();
  EXPECT_TRUE(join(address, "other")) << "the same key";
  const e2e::TemporaryDirectory otherKeys;
  listen(known,
         std::make_shared<tls::ServerTls>([&] { return tls::selfSigned(otherKeys.path(), {kSecond}); }, ""));
  address.address = addressOf(kFirst, true);
  EXPECT_THAT(
      refusal(address, "other"),
      AllOf(HasSubstr(addressOf(kSecond, true) + " is not the one expected"), HasSubstr("fingerprint")));
}

TEST_P(Redirects, ServerWithoutTlsIsNotFollowed) {
  listen(certificateFor({kFirst}));
  const auto joined = join(firstTrusted(), "other");
  ASSERT_FALSE(joined);
  EXPECT_THAT(joined.error().text, HasSubstr(addressOf(kSecond, true)));
  EXPECT_EQ(server().scenes.find("other")->subscribers.size(), 0u);
}

}  // namespace
}  // namespace clothstream::tests
