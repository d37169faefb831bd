// SPDX-License-Identifier: MIT
// The C interface over WebSocket, with a server in the same process.
#include <atomic>
#include <chrono>
#include <cstring>
#include <functional>
#include <memory>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/streambuf.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <clothstream/clothstream.h>
#include <dlfcn.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netdb.h>

#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/identity/authenticator.h"
#include "server/tls/server_tls.h"
#include "tests/e2e/link.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/support/eventually.h"

// Lookups of this name last until the semaphore is released.
constexpr const char* kStuckName = "stuck.invalid";
std::binary_semaphore stuckLookup{0};
std::atomic<int> endedLookups{0};

// The library calls this function instead of the one in libc.
extern "C" int getaddrinfo(const char* name, const char* service, const addrinfo* hints, addrinfo** found) {
  if (name == nullptr || std::strcmp(name, kStuckName) != 0) {
    static const auto original = reinterpret_cast<decltype(&getaddrinfo)>(dlsym(RTLD_NEXT, "getaddrinfo"));
    return original(name, service, hints, found);
  }
  stuckLookup.acquire();
  ++endedLookups;
  return EAI_NONAME;
}

namespace clothstream::tests {
namespace {

namespace net = boost::asio;
using namespace std::chrono_literals;
using net::ip::tcp;
using testing::AllOf;
using testing::HasSubstr;
using Clock = std::chrono::steady_clock;

clothstream_options defaults() {
  clothstream_options options;
  clothstream_default_options(&options);
  options.join_timeout_ms = 60'000;  // for sanitizers on a busy machine
  return options;
}

// A stream that is closed at its end.
class Stream {
 public:
  explicit Stream(const std::string& address, const clothstream_options& options = defaults())
      : result_(clothstream_open(address.c_str(), &options, &stream_)), error_(clothstream_error_text()) {}
  ~Stream() { clothstream_close(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  clothstream_result result() const { return result_; }
  const std::string& error() const { return error_; }
  clothstream_stream* get() const { return stream_; }

  template <typename Task>
  auto visit(Task task) {
    cs_client* const client = clothstream_acquire(stream_);
    const auto answer = task(client);
    clothstream_release(stream_);
    return answer;
  }
  cs_statistics statistics() {
    return visit([](cs_client* client) {
      cs_statistics statistics;
      cs_get_statistics(client, clothstream_now_us(), &statistics);
      return statistics;
    });
  }
  // Waits until more frames have come.
  bool streams(std::uint64_t frames) {
    const std::uint64_t wanted = statistics().frames + frames;
    return eventually([&] { return statistics().frames >= wanted; });
  }
  std::uint32_t participants() { return visit(cs_participant_count); }
  std::uint64_t id() { return visit(cs_participant_id); }

 private:
  clothstream_stream* stream_ = nullptr;
  clothstream_result result_;
  std::string error_;
};

class WebSocketLibrary : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (!IsSkipped()) listen({.port = 0});
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }
  void listen(const endpoint::WebEndpointOptions& options) {
    endpoint_.reset();
    endpoint_ = std::make_unique<endpoint::WebEndpoint>(server(), options);
  }
  std::string address(const std::string& scheme = "") const {
    return scheme + "127.0.0.1:" + std::to_string(endpoint_->port());
  }

  std::unique_ptr<endpoint::WebEndpoint> endpoint_;
};

TEST_F(WebSocketLibrary, StreamsToSeveralClientsOfOneProcess) {
  Stream first(address()), second(address("http://") + "/"), third(address("ws://"));
  for (Stream* stream : {&first, &second, &third}) {
    ASSERT_EQ(stream->result(), CLOTHSTREAM_OK) << stream->error();
    EXPECT_TRUE(stream->streams(20));
    EXPECT_EQ(stream->statistics().hash_mismatches, 0u);
    EXPECT_EQ(stream->statistics().decode_errors, 0u);
  }
  EXPECT_NE(first.id(), second.id());
}

TEST_F(WebSocketLibrary, ReachesAddressesOfVersionSix) {
  listen({.host = "::1", .port = 0});
  Stream stream("ws://[::1]:" + std::to_string(endpoint_->port()));
  ASSERT_EQ(stream.result(), CLOTHSTREAM_OK) << stream.error();
  EXPECT_TRUE(stream.streams(5));
}

TEST_F(WebSocketLibrary, SendsInputAndLeavesAtOnce) {
  Stream watcher(address());
  ASSERT_EQ(watcher.result(), CLOTHSTREAM_OK) << watcher.error();
  const auto colliderOf = [&](std::uint64_t id) {
    return watcher.visit([id](cs_client* client) {
      cs_collider collider;
      for (std::uint32_t i = 0; cs_get_collider(client, i, &collider) != 0; ++i)
        if (collider.participant_id == id) return true;
      return false;
    });
  };
  {
    Stream guest(address());
    ASSERT_EQ(guest.result(), CLOTHSTREAM_OK) << guest.error();
    const cs_own_collider sphere{.shape = CS_SHAPE_SPHERE,
                                 .position = {0.2f, 1, 0.3f},
                                 .orientation = {},
                                 .radius = 0.1f,
                                 .length = 0,
                                 .size = {},
                                 .top_radius = 0};
    guest.visit([&](cs_client* client) {
      cs_set_colliders(client, &sphere, 1, clothstream_now_us());
      return 0;
    });
    EXPECT_TRUE(eventually([&] { return colliderOf(guest.id()); }));
  }
  EXPECT_TRUE(eventually([&] { return watcher.participants() == 1; }));
  const auto presence = watcher.visit([](cs_client* client) {
    cs_presence newest{};
    cs_get_presence(client, &newest, nullptr);
    return newest;
  });
  EXPECT_EQ(presence.kind, static_cast<std::uint32_t>(CS_PRESENCE_LEFT));
  EXPECT_EQ(presence.reason, static_cast<std::uint32_t>(CS_LEAVE_LEFT));
}

// A lost connection says no goodbye, so the server keeps the place.
TEST_F(WebSocketLibrary, ResumesAfterItsConnectionWasCut) {
  e2e::Link link(endpoint_->port());
  Stream watcher(address()), guest("127.0.0.1:" + std::to_string(link.port()));
  ASSERT_EQ(guest.result(), CLOTHSTREAM_OK) << guest.error();
  ASSERT_TRUE(guest.streams(5));
  const std::uint64_t id = guest.id();
  const auto kind = [&] {
    return watcher.visit([](cs_client* client) {
      cs_presence presence{};
      cs_get_presence(client, &presence, nullptr);
      return presence.kind;
    });
  };
  link.cut();
  EXPECT_TRUE(eventually([&] { return kind() == CS_PRESENCE_DISCONNECTED; }));
  EXPECT_EQ(watcher.participants(), 2u);
  link.restore();
  EXPECT_TRUE(eventually([&] { return kind() == CS_PRESENCE_RETURNED; }));
  EXPECT_TRUE(guest.streams(5));
  EXPECT_EQ(guest.visit(cs_resumed), 1);
  EXPECT_EQ(guest.id(), id);
  std::uint32_t events = 0;
  EXPECT_EQ(clothstream_wait(guest.get(), 0, &events), CLOTHSTREAM_OK);
}

TEST_F(WebSocketLibrary, TellsTheServersReason) {
  clothstream_options options = defaults();
  options.scene = "no such scene";
  const Stream unknown(address(), options);
  EXPECT_EQ(unknown.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(unknown.error(), AllOf(HasSubstr(address()), HasSubstr("no such scene")));
}

TEST_F(WebSocketLibrary, ReportsAServerThatStops) {
  clothstream_options options = defaults();
  options.reconnect_for_ms = 0;
  Stream stream(address(), options);
  ASSERT_EQ(stream.result(), CLOTHSTREAM_OK) << stream.error();
  const std::string served = address();
  endpoint_.reset();
  std::uint32_t events = 0;
  EXPECT_TRUE(eventually([&] { return clothstream_wait(stream.get(), 100, &events) == CLOTHSTREAM_LOST; }));
  EXPECT_THAT(clothstream_error_text(), HasSubstr(served));
  EXPECT_GT(stream.visit(cs_vertex_count), 0u);
}

// ---- Options

TEST(WebSocketLibraryOptions, AreRefusedWithTheReason) {
  const auto refused = [](const std::string& address,
                          const std::function<void(clothstream_options&)>& change) {
    clothstream_options options = defaults();
    change(options);
    const Stream stream(address, options);
    EXPECT_EQ(stream.result(), CLOTHSTREAM_INVALID);
    return stream.error();
  };
  const std::string fingerprint(64, 'a');
  EXPECT_THAT(refused("host", [](auto& options) { options.version = 4; }), HasSubstr("accepts 3"));
  EXPECT_THAT(refused("host", [](auto& options) { options.token = nullptr; }), HasSubstr("NULL"));
  EXPECT_THAT(refused("host", [&](auto& options) { options.fingerprint = fingerprint.c_str(); }),
              HasSubstr("need TLS: use https://host:8080"));
  EXPECT_THAT(refused("wss://host", [](auto& options) { options.fingerprint = "12:34"; }),
              HasSubstr("64 hexadecimal digits"));
  EXPECT_THAT(refused("wss://host", [](auto& options) { options.ca_file = "/no/such/file"; }),
              HasSubstr("/no/such/file"));
  EXPECT_THAT(refused("wss://host", [](auto& options) { options.ca_file = "tests/e2e/small.json"; }),
              HasSubstr("tests/e2e/small.json"));
  EXPECT_THAT(refused("wss://host",
                      [&](auto& options) {
                        options.fingerprint = fingerprint.c_str();
                        options.ca_file = "tests/e2e/small.json";
                      }),
              HasSubstr("both set"));
  EXPECT_THAT(refused("host:port", [](auto&) {}), HasSubstr("1 to 65535"));
}

TEST(WebSocketLibraryOptions, SendNoSecretsToOtherMachinesWithoutTls) {
  clothstream_options options = defaults();
  options.token = "secret";
  const Stream stream("ws://192.0.2.2", options);
  EXPECT_EQ(stream.result(), CLOTHSTREAM_INVALID);
  EXPECT_THAT(stream.error(), AllOf(HasSubstr("others in the network"), HasSubstr("https://192.0.2.2:8080")));
  EXPECT_THAT(stream.error(), testing::Not(HasSubstr("secret")));
  char token[CLOTHSTREAM_TOKEN_BYTES];
  EXPECT_EQ(clothstream_pair("192.0.2.2", "123456", nullptr, token, sizeof token), CLOTHSTREAM_INVALID);
  EXPECT_THAT(clothstream_error_text(), HasSubstr("pairing code"));
}

// ---- TLS

class WebSocketLibraryTls : public WebSocketLibrary {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    tls_ = std::make_shared<tls::ServerTls>(
        [this] {
          return tls::selfSigned(directory_.path(), {"localhost", "127.0.0.1"});
        },
        "");
    fingerprint_ = tls_->fingerprint();
    listen({.port = 0, .tls = tls_});
  }

  e2e::TemporaryDirectory directory_;
  std::shared_ptr<tls::ServerTls> tls_;
  std::string fingerprint_;
};

TEST_F(WebSocketLibraryTls, TrustsFingerprintOrAuthority) {
  clothstream_options options = defaults();
  options.fingerprint = fingerprint_.c_str();
  for (const char* scheme : {"wss://", "https://"}) {
    Stream byKey(address(scheme), options);
    ASSERT_EQ(byKey.result(), CLOTHSTREAM_OK) << byKey.error();
    EXPECT_TRUE(byKey.streams(10));
    EXPECT_EQ(byKey.statistics().hash_mismatches, 0u);
  }
  options = defaults();
  const std::string file = directory_.path() / "self.pem";
  options.ca_file = file.c_str();
  for (const std::string& host : {std::string("127.0.0.1:"), std::string("localhost:")}) {
    Stream bySignature("wss://" + host + std::to_string(endpoint_->port()), options);
    ASSERT_EQ(bySignature.result(), CLOTHSTREAM_OK) << bySignature.error();
    EXPECT_TRUE(bySignature.streams(5));
  }
}

TEST_F(WebSocketLibraryTls, RefusesOtherServersAndShowsTheirKey) {
  std::string other = fingerprint_;
  other.front() = other.front() == '0' ? '1' : '0';
  clothstream_options options = defaults();
  options.fingerprint = other.c_str();
  const Stream impostor(address("wss://"), options);
  EXPECT_EQ(impostor.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(impostor.error(), AllOf(HasSubstr("not the one expected"), HasSubstr(fingerprint_)));

  const Stream unknown(address("wss://"));
  EXPECT_EQ(unknown.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(unknown.error(), AllOf(HasSubstr("no known authority"), HasSubstr(fingerprint_)));

  // Signed, but for other names: 127.0.0.2 is this machine too.
  options = defaults();
  const std::string file = directory_.path() / "self.pem";
  options.ca_file = file.c_str();
  listen({.host = "127.0.0.2", .port = 0, .tls = tls_});
  const Stream wrongName("wss://127.0.0.2:" + std::to_string(endpoint_->port()), options);
  EXPECT_EQ(wrongName.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(wrongName.error(), HasSubstr("for this name"));
}

TEST_F(WebSocketLibraryTls, SaysWhichSideHasTls) {
  const Stream plain(address());
  EXPECT_EQ(plain.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(plain.error(), HasSubstr("uses TLS"));
  listen({.port = 0});
  const Stream encrypted(address("wss://"));
  EXPECT_EQ(encrypted.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(encrypted.error(), HasSubstr("ws:// if it has no TLS"));
}

// ---- Identity

class WebSocketLibraryIdentity : public WebSocketLibrary {
 protected:
  hosting::ServerOptions options() override {
    hosting::ServerOptions options;
    options.authenticator = authenticator_ = std::make_shared<identity::Authenticator>(
        identity::AuthenticatorOptions{.keyDirectory = {}, .pairing = true, .stateDirectory = state_.path()});
    return options;
  }
  // Pairs with this code. Returns the token, or the error after its result.
  std::string pair(const std::string& code) {
    char token[CLOTHSTREAM_TOKEN_BYTES];
    const clothstream_result result =
        clothstream_pair(address().c_str(), code.c_str(), nullptr, token, sizeof token);
    return result == CLOTHSTREAM_OK ? token : std::to_string(result) + " " + clothstream_error_text();
  }

  e2e::TemporaryDirectory state_;
  std::shared_ptr<identity::Authenticator> authenticator_;
};

TEST_F(WebSocketLibraryIdentity, PairsWithoutJoiningAndJoinsWithTheToken) {
  const auto code = authenticator_->makeCode(scene::Role::participant, schedule::Clock::now());
  ASSERT_TRUE(code);
  const std::string wrong = code->code == "000000" ? "000001" : "000000";
  EXPECT_THAT(pair(wrong), AllOf(HasSubstr("3 "), HasSubstr("refuses"), HasSubstr("code")));
  EXPECT_THAT(pair(""), HasSubstr("six digits"));
  const std::string token = pair(code->code);
  ASSERT_GT(token.size(), 40u) << token;

  const Stream without(address());
  EXPECT_EQ(without.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(without.error(), HasSubstr("token"));
  clothstream_options options = defaults();
  const std::string forged = token.substr(0, token.size() - 8) + "AAAAAAAA";
  options.token = forged.c_str();
  const Stream withForged(address(), options);
  EXPECT_EQ(withForged.result(), CLOTHSTREAM_REFUSED);

  options.token = token.c_str();
  Stream joined(address(), options);
  ASSERT_EQ(joined.result(), CLOTHSTREAM_OK) << joined.error();
  EXPECT_EQ(joined.participants(), 1u);
}

TEST_F(WebSocketLibrary, SaysThatAServerNeedsNoPairing) {
  char token[CLOTHSTREAM_TOKEN_BYTES];
  EXPECT_EQ(clothstream_pair(address().c_str(), "123456", nullptr, token, sizeof token), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(clothstream_error_text(), HasSubstr("pairing"));
  EXPECT_STREQ(token, "");
  clothstream_options options = defaults();
  options.version = 9;
  EXPECT_EQ(clothstream_pair(address().c_str(), "123456", &options, token, sizeof token),
            CLOTHSTREAM_INVALID);
}

// ---- What is no clothstream-server

// Serves one connection after the other on a thread.
class OtherServer {
 public:
  using Serve = std::function<void(tcp::socket&)>;
  explicit OtherServer(Serve serve)
      : acceptor_(io_, {net::ip::address_v4::loopback(), 0}),
        port_(acceptor_.local_endpoint().port()),
        thread_([this, serve = std::move(serve)] {
          for (;;) {
            boost::system::error_code error;
            tcp::socket socket = acceptor_.accept(error);
            if (error || ends_) return;
            try {
              serve(socket);
            } catch (const std::exception&) {
              // The client has gone.
            }
          }
        }) {}
  ~OtherServer() {
    ends_ = true;
    boost::system::error_code ignored;
    tcp::socket(io_).connect({net::ip::address_v4::loopback(), port_}, ignored);
    thread_.join();
  }
  std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

  static void readRequest(tcp::socket& socket) {
    net::streambuf buffer;
    net::read_until(socket, buffer, "\r\n\r\n");
  }

 private:
  net::io_context io_;
  tcp::acceptor acceptor_;
  const std::uint16_t port_;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

TEST(WebSocketLibraryElsewhere, NamesTheHttpStatus) {
  const OtherServer server([](tcp::socket& socket) {
    OtherServer::readRequest(socket);
    net::write(socket, net::buffer(std::string("HTTP/1.1 404 Not Found\r\nServer: other\r\nContent-Length: "
                                               "4\r\n\r\nnone")));
  });
  const Stream stream(server.address());
  EXPECT_EQ(stream.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(stream.error(), AllOf(HasSubstr(server.address()), HasSubstr("HTTP status 404 (Not Found)")));
}

TEST(WebSocketLibraryElsewhere, RefusesWhatIsNotHttp) {
  const OtherServer server([](tcp::socket& socket) {
    net::write(socket, net::buffer(std::string("220 mail ready\r\n\r\n")));
    OtherServer::readRequest(socket);
  });
  const Stream stream(server.address());
  EXPECT_EQ(stream.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(stream.error(), HasSubstr("something else"));
}

TEST(WebSocketLibraryElsewhere, ReportsAPortWithoutServer) {
  std::string address;
  {
    const OtherServer server([](tcp::socket&) {});
    address = server.address();
  }
  const Stream stream(address);
  EXPECT_EQ(stream.result(), CLOTHSTREAM_UNREACHABLE);
  EXPECT_THAT(stream.error(), AllOf(HasSubstr(address), HasSubstr("No server answers")));
}

// A server that accepts and says nothing costs no more than the time to join.
TEST(WebSocketLibraryElsewhere, GivesUpAServerThatSaysNothing) {
  const OtherServer server([](tcp::socket& socket) {
    char byte = 0;
    while (socket.read_some(net::buffer(&byte, 1)) > 0) {
    }
  });
  clothstream_options options = defaults();
  options.join_timeout_ms = 300;
  const auto begun = Clock::now();
  const Stream stream(server.address(), options);
  EXPECT_LT(Clock::now() - begun, 10s);
  EXPECT_EQ(stream.result(), CLOTHSTREAM_UNREACHABLE);
  EXPECT_THAT(stream.error(), HasSubstr("within 0.3 s"));
}

// A name server that does not answer blocks getaddrinfo() for up to half a minute.
TEST(WebSocketLibraryElsewhere, DoesNotWaitForTheNameServer) {
  clothstream_options options = defaults();
  options.join_timeout_ms = 200;
  const auto begun = Clock::now();
  const Stream stream(kStuckName, options);
  EXPECT_LT(Clock::now() - begun, 10s);
  EXPECT_EQ(stream.result(), CLOTHSTREAM_UNREACHABLE);
  EXPECT_EQ(endedLookups, 0) << "the lookup is still under way";
  stuckLookup.release();
  EXPECT_TRUE(eventually([] { return endedLookups == 1; }));
}

TEST(WebSocketLibraryElsewhere, NamesAnUnknownHost) {
  const Stream stream("no-such-host.invalid");
  EXPECT_EQ(stream.result(), CLOTHSTREAM_UNREACHABLE);
  EXPECT_THAT(stream.error(), AllOf(HasSubstr("no-such-host.invalid:8080"), HasSubstr("is not known")));
}

TEST(WebSocketLibraryElsewhere, RefusesAnnouncedHugeMessageAtOnce) {
  std::atomic<unsigned> code{0};
  const OtherServer server([&](tcp::socket& socket) {
    boost::beast::websocket::stream<tcp::socket&> stream(socket);
    stream.accept();
    // The header of a binary frame of 2^40 bytes (RFC 6455 5.2).
    const unsigned char header[] = {0x82, 127, 0, 0, 1, 0, 0, 0, 0, 0};
    net::write(socket, net::buffer(header));
    net::streambuf buffer;
    boost::system::error_code ended;
    while (!ended) stream.read(buffer, ended);
    code = stream.reason().code;
  });
  const Stream stream(server.address());
  EXPECT_TRUE(eventually([&] { return code == boost::beast::websocket::close_code::too_big; }));
  EXPECT_EQ(stream.result(), CLOTHSTREAM_UNREACHABLE);
  EXPECT_THAT(stream.error(), HasSubstr("exceeded"));
}

TEST(WebSocketLibraryElsewhere, RefusesWebSocketsOfOthers) {
  const OtherServer server([](tcp::socket& socket) {
    boost::beast::websocket::stream<tcp::socket&> stream(socket);
    stream.accept();
    stream.binary(true);
    stream.write(net::buffer(std::string("\xff\xff\xff\xff")));
    net::streambuf buffer;
    for (;;) stream.read(buffer);
  });
  const Stream stream(server.address());
  EXPECT_EQ(stream.result(), CLOTHSTREAM_REFUSED);
  EXPECT_THAT(stream.error(), HasSubstr("malformed ServerMessage"));
}

}  // namespace
}  // namespace clothstream::tests
