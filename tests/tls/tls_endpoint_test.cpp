// SPDX-License-Identifier: MIT
// The web endpoint with TLS.
#include <atomic>
#include <chrono>
#include <ctime>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/ssl.h>
#include <sys/stat.h>

#include "clothstream/v1/session.pb.h"
#include "proto/tls/fingerprint.h"
#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "server/tls/server_tls.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/endpoint/page_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/viewer.h"
#include "tests/endpoint/web_client.h"
#include "tests/support/eventually.h"
#include "tests/tls/client_certificate.h"

namespace clothstream::tests {
namespace {

namespace ssl = net::ssl;
using net::ip::tcp;
using testing::HasSubstr;

class TlsEndpoint : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    files_.write("index.html", "<html>cloth</html>");
    tls_ =
        std::make_shared<tls::ServerTls>([this] { return tls::selfSigned(directory(), {"localhost"}); }, "");
    endpoint_ = std::make_unique<endpoint::WebEndpoint>(
        server(), endpoint::WebEndpointOptions{.port = 0, .pageDirectory = files_.path(), .tls = tls_});
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }

  // Directory of the certificate that is loaded next.
  std::filesystem::path directory() const { return keys_.path() / key_; }
  telemetry::Counter& failedHandshakes() {
    return server().metrics.refusals[static_cast<std::size_t>(telemetry::Refusal::handshake)];
  }

  e2e::TemporaryDirectory keys_;
  std::string key_ = "first";
  PageDirectory files_;
  std::shared_ptr<tls::ServerTls> tls_;
  std::unique_ptr<endpoint::WebEndpoint> endpoint_;
};

// A client that accepts every certificate and remembers its fingerprint.
class TlsClient {
 public:
  explicit TlsClient(std::uint16_t port, int newestVersion = TLS1_3_VERSION) {
    SSL_set_security_level(stream_.native_handle(), 0);  // offers old versions
    SSL_set_min_proto_version(stream_.native_handle(), TLS1_VERSION);
    SSL_set_max_proto_version(stream_.native_handle(), newestVersion);
    beast::get_lowest_layer(stream_).connect({net::ip::make_address("127.0.0.1"), port});
    const timeval patience{kPatience.count(), 0};
    ::setsockopt(stream_.next_layer().native_handle(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  }
  // Shows this certificate to the server.
  void use(const tls::Certificate& certificate) {
    context_.use_certificate_chain(net::buffer(certificate.chain));
    context_.use_private_key(net::buffer(certificate.key), ssl::context::pem);
    SSL_use_certificate(stream_.native_handle(), SSL_CTX_get0_certificate(context_.native_handle()));
    SSL_use_PrivateKey(stream_.native_handle(), SSL_CTX_get0_privatekey(context_.native_handle()));
  }
  // Session for a later connection. With TLS 1.3 the server has sent it after the first answer.
  std::shared_ptr<SSL_SESSION> session() {
    return {SSL_get1_session(stream_.native_handle()), &SSL_SESSION_free};
  }
  void resume(const std::shared_ptr<SSL_SESSION>& session) {
    SSL_set_session(stream_.native_handle(), session.get());
  }
  bool isResumed() { return SSL_session_reused(stream_.native_handle()) == 1; }
  beast::error_code shakeHands() {
    beast::error_code error;
    stream_.handshake(ssl::stream_base::client, error);
    if (X509* const certificate = error ? nullptr : SSL_get1_peer_certificate(stream_.native_handle())) {
      fingerprint_ = fingerprintOf(*certificate).value_or("");
      X509_free(certificate);
    }
    return error;
  }
  Response get(const std::string& target) {
    http::request<http::string_body> request(http::verb::get, target, 11);
    request.set(http::field::host, "127.0.0.1");
    http::write(stream_, request);
    Response response;
    http::read(stream_, buffer_, response);
    return response;
  }
  const std::string& fingerprint() const { return fingerprint_; }
  ssl::stream<tcp::socket>& stream() { return stream_; }

 private:
  net::io_context io_;
  ssl::context context_{ssl::context::tls_client};
  ssl::stream<tcp::socket> stream_{io_, context_};
  beast::flat_buffer buffer_;
  std::string fingerprint_;
};

using TlsStream = websocket::stream<ssl::stream<tcp::socket>&>;

void joinSmall(TlsStream& stream) {
  stream.handshake("127.0.0.1", "/stream");
  stream.binary(true);
  stream.write(net::buffer(hello("small")));
}

v1::ServerMessage nextMessage(TlsStream& stream) {
  beast::flat_buffer incoming;
  stream.read(incoming);
  v1::ServerMessage message;
  EXPECT_TRUE(message.ParseFromArray(incoming.cdata().data(), static_cast<int>(incoming.size())));
  return message;
}

TEST_F(TlsEndpoint, ServesPageAndStream) {
  TlsClient client(endpoint_->port());
  ASSERT_FALSE(client.shakeHands());
  EXPECT_EQ(client.fingerprint(), tls_->fingerprint());
  EXPECT_EQ(client.get("/").body(), "<html>cloth</html>");
  EXPECT_EQ(client.get("/none").result(), http::status::not_found);

  TlsStream stream(client.stream());
  joinSmall(stream);
  while (!nextMessage(stream).has_frame()) {
  }
  stream.close(websocket::close_code::normal);
  EXPECT_EQ(failedHandshakes().value(), 0U);
}

// WinHTTP cuts the connection after its close frame.
TEST_F(TlsEndpoint, TakesCloseFrameAsGoodbyeWithoutTheEndOfTls) {
  TlsClient watcher(endpoint_->port()), leaving(endpoint_->port());
  ASSERT_FALSE(watcher.shakeHands());
  ASSERT_FALSE(leaving.shakeHands());
  TlsStream watcherStream(watcher.stream()), leavingStream(leaving.stream());
  joinSmall(watcherStream);
  while (!nextMessage(watcherStream).has_frame()) {
  }
  joinSmall(leavingStream);
  while (!nextMessage(leavingStream).has_frame()) {
  }
  // A close frame with the code 1000 and a mask of zeros.
  net::write(leaving.stream(), net::buffer(std::string("\x88\x82\0\0\0\0\x03\xe8", 8)));
  leaving.stream().next_layer().close();
  v1::PresenceKind kind = v1::PRESENCE_KIND_UNSPECIFIED;
  while (kind != v1::PRESENCE_KIND_LEFT && kind != v1::PRESENCE_KIND_DISCONNECTED)
    kind = nextMessage(watcherStream).presence().kind();
  EXPECT_EQ(kind, v1::PRESENCE_KIND_LEFT);
}

TEST_F(TlsEndpoint, RedirectsRequestsWithoutTls) {
  HttpClient client(endpoint_->port());
  const Response response = client.get("/page?scene=flag");
  EXPECT_EQ(response.result(), http::status::permanent_redirect);
  EXPECT_EQ(std::string(response[http::field::location]), "https://localhost/page?scene=flag");
  EXPECT_TRUE(client.closes());
  HttpClient stranger(endpoint_->port());
  stranger.send("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n");
  EXPECT_EQ(stranger.readResponse().result(), http::status::misdirected_request);
}

TEST_F(TlsEndpoint, RefusesOldVersions) {
  TlsClient old(endpoint_->port(), TLS1_1_VERSION);
  EXPECT_TRUE(old.shakeHands());
  EXPECT_TRUE(eventually([&] { return failedHandshakes().value() == 1; }));
  TlsClient enough(endpoint_->port(), TLS1_2_VERSION);
  EXPECT_FALSE(enough.shakeHands());
}

TEST_F(TlsEndpoint, ClosesHandshakeThatDoesNotEnd) {
  HttpClient client(endpoint_->port());
  // The first bytes of a ClientHello of 512 bytes.
  client.send(std::string("\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03", 11));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(client.closes());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_TRUE(eventually([&] { return failedHandshakes().value() == 1; }));
}

TEST_F(TlsEndpoint, UsesNewCertificateForNewConnectionsOnly) {
  TlsClient before(endpoint_->port());
  ASSERT_FALSE(before.shakeHands());
  const std::string first = tls_->fingerprint();
  key_ = "second";
  tls_->reload();
  TlsClient after(endpoint_->port());
  ASSERT_FALSE(after.shakeHands());
  EXPECT_NE(after.fingerprint(), first);
  EXPECT_EQ(after.fingerprint(), tls_->fingerprint());
  EXPECT_EQ(before.get("/").body(), "<html>cloth</html>") << "an open connection continues";
}

class TlsEndpointWithClientCa : public TlsEndpoint {
 protected:
  void SetUp() override {
    TlsEndpoint::SetUp();
    if (IsSkipped()) return;
    tls_ = std::make_shared<tls::ServerTls>([this] { return tls::selfSigned(directory(), {"localhost"}); },
                                            client_.chain);
    endpoint_.reset();
    endpoint_ = std::make_unique<endpoint::WebEndpoint>(
        server(), endpoint::WebEndpointOptions{.port = 0, .pageDirectory = files_.path(), .tls = tls_});
  }

  const tls::Certificate client_ = makeClientCertificate();
};

TEST_F(TlsEndpointWithClientCa, ResumesSessions) {
  for (const int version : {TLS1_2_VERSION, TLS1_3_VERSION})
    for (const bool hasCertificate : {false, true}) {
      TlsClient first(endpoint_->port(), version);
      if (hasCertificate) first.use(client_);
      ASSERT_FALSE(first.shakeHands());
      EXPECT_EQ(first.get("/").body(), "<html>cloth</html>");
      TlsClient second(endpoint_->port(), version);
      if (hasCertificate) second.use(client_);
      second.resume(first.session());
      ASSERT_FALSE(second.shakeHands());
      EXPECT_TRUE(second.isResumed());
      EXPECT_EQ(second.get("/").body(), "<html>cloth</html>");
    }
  EXPECT_EQ(failedHandshakes().value(), 0U);
}

TEST_F(TlsEndpointWithClientCa, RefusesOnlyCertificatesOfOtherAuthorities) {
  TlsClient stranger(endpoint_->port(), TLS1_2_VERSION);
  stranger.use(makeClientCertificate());
  EXPECT_TRUE(stranger.shakeHands());
  EXPECT_TRUE(eventually([&] { return failedHandshakes().value() == 1; }));
  for (const bool hasCertificate : {false, true}) {
    TlsClient client(endpoint_->port());
    if (hasCertificate) client.use(client_);
    ASSERT_FALSE(client.shakeHands());
    EXPECT_EQ(client.get("/").body(), "<html>cloth</html>");
  }
}

TEST_F(TlsEndpoint, RefusesTargetThatWouldRedirectToAnotherHost) {
  HttpClient client(endpoint_->port());
  client.send("GET @evil.example/ HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readResponse().result(), http::status::bad_request);
  EXPECT_TRUE(client.closes());
}

// gRPC reads the chain and the key one after the other, and again if the file has changed in between.
TEST(ServerTlsTest, FileAlwaysHasAChainAndItsKey) {
  const e2e::TemporaryDirectory directory;
  bool second = false;
  tls::ServerTls tls(
      [&] { return tls::selfSigned(directory.path() / (second ? "second" : "first"), {"localhost"}); }, "");
  const std::string path = tls.certificatePath();
  const auto changed = [&] {
    struct stat file {};
    EXPECT_EQ(::stat(path.c_str(), &file), 0);
    return file.st_mtime;
  };
  std::atomic<int> reads = 0;
  std::jthread reader([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const std::time_t before = changed();
      try {
        tls::readCertificate(path, path);
        ++reads;
      } catch (const std::exception& mismatch) {
        EXPECT_NE(changed(), before) << mismatch.what();
      }
    }
  });
  for (int i = 0; i < 200; ++i) {
    second = !second;
    tls.reload();
  }
  EXPECT_TRUE(eventually([&] { return reads > 0; }));
  reader = {};
  EXPECT_EQ(fingerprintOf(tls::readCertificate(path, path).chain).value(), tls.fingerprint());
}

TEST(ServerTlsTest, KeepsTheOldCertificateIfTheNewOneIsBad) {
  const e2e::TemporaryDirectory directory;
  bool bad = false;
  tls::ServerTls tls(
      [&] {
        tls::Certificate certificate = tls::selfSigned(directory.path(), {"localhost"});
        if (bad) certificate.key = tls::selfSigned(directory.path() / "other", {"localhost"}).key;
        return certificate;
      },
      "");
  const std::string fingerprint = tls.fingerprint();
  const auto context = tls.context();
  bad = true;
  EXPECT_THROW(tls.reload(), std::runtime_error);
  EXPECT_EQ(tls.fingerprint(), fingerprint);
  EXPECT_EQ(tls.context(), context);
  const tls::Certificate shown = tls::readCertificate(tls.certificatePath(), tls.certificatePath());
  EXPECT_EQ(fingerprintOf(shown.chain).value(), fingerprint);
}

}  // namespace
}  // namespace clothstream::tests
