// SPDX-License-Identifier: MIT
// The page over HTTP, with valid and invalid requests.
#include <memory>
#include <vector>

#include <gmock/gmock.h>

#include "server/endpoint/web/web_endpoint.h"
#include "server/hosting/scene_server.h"
#include "tests/endpoint/page_directory.h"
#include "tests/endpoint/small_server.h"
#include "tests/endpoint/web_client.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;

std::string field(const Response& response, http::field name) {
  const auto value = response[name];
  return {value.data(), value.size()};
}

class HttpEndpoint : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    files_.write("index.html", "<html>cloth</html>");
    files_.write("core.wasm", std::string("\0asm", 4));
    files_.writeOutside("secret.txt", "secret");
    open({});
  }
  void TearDown() override {
    endpoint_.reset();
    SmallServer::TearDown();
  }
  void open(endpoint::WebEndpointOptions options) {
    endpoint_.reset();
    options.port = 0;
    options.pageDirectory = files_.path();
    endpoint_ = std::make_unique<endpoint::WebEndpoint>(server(), options);
  }
  Response get(const std::string& target, const std::string& fields = "", const std::string& method = "GET") {
    return HttpClient(endpoint_->port()).get(target, fields, method);
  }

  PageDirectory files_;
  std::unique_ptr<endpoint::WebEndpoint> endpoint_;
};

TEST_F(HttpEndpoint, ServesThePage) {
  const Response page = get("/");
  EXPECT_EQ(page.result(), http::status::ok);
  EXPECT_EQ(page.body(), "<html>cloth</html>");
  EXPECT_EQ(field(page, http::field::content_type), "text/html; charset=utf-8");
  const Response core = get("/core.wasm");
  EXPECT_EQ(core.body(), std::string("\0asm", 4));
  EXPECT_EQ(field(core, http::field::content_type), "application/wasm");
}

TEST_F(HttpEndpoint, TellsThePageItsAddressForOtherDevices) {
  EXPECT_EQ(get("/address.json").body(), R"({"address":"","fingerprint":""})");
  EXPECT_EQ(get("/address.svg").result(), http::status::not_found);
  open({.hostInNetwork = "192.0.2.2", .showsFingerprint = true});
  const std::string port = std::to_string(endpoint_->port());
  // Without TLS there is no key.
  EXPECT_EQ(get("/address.json").body(),
            R"({"address":"http://192.0.2.2:)" + port + R"(/","fingerprint":""})");
  const Response code = get("/address.svg");
  EXPECT_EQ(field(code, http::field::content_type), "image/svg+xml");
  EXPECT_THAT(code.body(), HasSubstr("<svg"));
  open({.hostInNetwork = "2001:db8::2"});
  EXPECT_THAT(get("/address.json").body(), HasSubstr("http://[2001:db8::2]:"));
}

TEST_F(HttpEndpoint, AnswersSeveralRequestsOnOneConnection) {
  HttpClient client(endpoint_->port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.get("/").result(), http::status::ok);
  client.send("GET / HTTP/1.1\r\nHost: localhost\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(client.readResponse().body(), "<html>cloth</html>");
  EXPECT_EQ(client.readResponse().body(), "ok");
}

TEST_F(HttpEndpoint, ForbidsFramesOfThePage) {
  const Response page = get("/");
  EXPECT_EQ(std::string(page["Content-Security-Policy"]), "frame-ancestors 'none'");
  EXPECT_EQ(std::string(page["Cross-Origin-Opener-Policy"]), "same-origin");
  EXPECT_EQ(std::string(page["Cross-Origin-Embedder-Policy"]), "require-corp");
  EXPECT_EQ(std::string(page["X-Frame-Options"]), "DENY");
}

TEST_F(HttpEndpoint, RefusesTooManyRequestsOnOneConnection) {
  std::string requests;
  for (int i = 0; i < 1000; ++i) requests += "GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n";
  HttpClient client(endpoint_->port());
  client.send(requests);
  int answered = 0;
  Response response = client.readResponse();
  for (; response.result() == http::status::ok; response = client.readResponse()) ++answered;
  EXPECT_GE(answered, 200) << "as many at once";
  EXPECT_EQ(response.result(), http::status::too_many_requests);
  EXPECT_EQ(response.body(), "Too many requests: try again in a second.\n");
  EXPECT_TRUE(client.closes());
  const auto reason = static_cast<std::size_t>(telemetry::Refusal::requestRate);
  EXPECT_EQ(server().metrics.refusals[reason].value(), 1U);
  EXPECT_NO_THROW(WebSocketClient(endpoint_->port())) << "the rate of connections limits WebSockets";
}

TEST_F(HttpEndpoint, RefusesNamesThatItDoesNotHave) {
  HttpClient client(endpoint_->port());
  client.send("GET / HTTP/1.1\r\nHost: evil.example:8080\r\n\r\n");
  const Response refused = client.readResponse();
  EXPECT_EQ(refused.result(), http::status::misdirected_request);
  EXPECT_THAT(refused.body(), HasSubstr("--public-name"));
}

TEST_F(HttpEndpoint, AnswersHeadWithSizeButNoContent) {
  HttpClient client(endpoint_->port());
  const Response head = client.get("/", "", "HEAD");
  EXPECT_EQ(head.result(), http::status::ok);
  EXPECT_EQ(field(head, http::field::content_length), "18");
  EXPECT_EQ(client.get("/healthz").body(), "ok");  // so no body came before it
}

TEST_F(HttpEndpoint, DoesNotResendFileThatBrowserHas) {
  const Response first = get("/core.wasm");
  EXPECT_EQ(field(first, http::field::cache_control), "no-cache");
  HttpClient client(endpoint_->port());
  const Response repeated =
      client.get("/core.wasm", "If-None-Match: " + field(first, http::field::etag) + "\r\n");
  EXPECT_EQ(repeated.result(), http::status::not_modified);
  EXPECT_EQ(repeated.body(), "");
  EXPECT_EQ(client.get("/core.wasm", "If-None-Match: \"old\"\r\n").result(), http::status::ok);
}

TEST_F(HttpEndpoint, AnswersNotFoundForUnknownPath) {
  EXPECT_EQ(get("/nothing.js").result(), http::status::not_found);
}

TEST_F(HttpEndpoint, ServesNothingOutsideThePage) {
  for (const char* target : {"/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/./../secret.txt",
                             "//etc/passwd", "/%2fetc/passwd"}) {
    const Response response = get(target);
    EXPECT_EQ(response.result(), http::status::not_found) << target;
    EXPECT_THAT(response.body(), testing::Not(HasSubstr("secret"))) << target;
  }
}

TEST_F(HttpEndpoint, NamesAllowedMethodsWhenItRefusesAnother) {
  const Response response = get("/", "", "DELETE");
  EXPECT_EQ(response.result(), http::status::method_not_allowed);
  EXPECT_EQ(field(response, http::field::allow), "GET, HEAD");
}

TEST_F(HttpEndpoint, RefusesBodyWithoutReadingIt) {
  HttpClient client(endpoint_->port());
  client.send("POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n\r\n" +
              std::string(20'000, 'x'));
  EXPECT_EQ(client.readResponse().result(), http::status::payload_too_large);
  for (const char* encoding : {"chunked", "xchunked", "identity", "gzip", "gzip, xchunked"}) {
    // The bytes after the header must not count as a request.
    HttpClient encoded(endpoint_->port());
    encoded.send("POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: " + std::string(encoding) +
                 "\r\n\r\nGET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n");
    EXPECT_EQ(encoded.readResponse().result(), http::status::payload_too_large) << encoding;
    EXPECT_TRUE(encoded.closes()) << encoding;
  }
}

TEST_F(HttpEndpoint, RefusesHugeHeader) {
  const Response response = get("/", "X-Huge: " + std::string(17 * 1024, 'x') + "\r\n");
  EXPECT_EQ(response.result(), http::status::request_header_fields_too_large);
}

TEST_F(HttpEndpoint, ClosesConnectionAfterBadRequest) {
  HttpClient client(endpoint_->port());
  client.send("\x16\x03\x01 this is no HTTP\r\n\r\n");
  EXPECT_EQ(client.readResponse().result(), http::status::bad_request);
  EXPECT_TRUE(client.closes());
  EXPECT_EQ(get("/").result(), http::status::ok);
}

TEST_F(HttpEndpoint, ClosesAConnectionThatNeverFinishesItsHeader) {
  HttpClient client(endpoint_->port());
  client.send("GET / HTTP/1.1\r\nHost: localhost\r\n");
  EXPECT_TRUE(client.closes());  // only the server's timeout ends this wait
}

TEST_F(HttpEndpoint, AnswersHealthCheck) {
  const Response response = get("/healthz");
  EXPECT_EQ(response.result(), http::status::ok);
  EXPECT_EQ(response.body(), "ok");
}

TEST_F(HttpEndpoint, RequiresWebSocketAtStreamPath) {
  EXPECT_EQ(get("/stream").result(), http::status::upgrade_required);
  EXPECT_EQ(get("/stream", "Connection: Upgrade\r\nUpgrade: h2c\r\n").result(),
            http::status::upgrade_required);
  const Response oldVersion = get("/stream",
                                  "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 7\r\n"
                                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n");
  EXPECT_GE(oldVersion.result_int(), 400U);
  const Response noKey =
      get("/stream", "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n");
  EXPECT_GE(noKey.result_int(), 400U);
}

TEST_F(HttpEndpoint, RefusesConnectionBeyondLimit) {
  endpoint::WebEndpointOptions options;
  options.maxConnections = 3;
  open(options);
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<HttpClient>(endpoint_->port()));
    EXPECT_EQ(clients.back()->get("/healthz").result(), http::status::ok);
  }
  EXPECT_EQ(get("/").result(), http::status::service_unavailable);
  EXPECT_EQ(clients.front()->get("/").result(), http::status::ok) << "open connections are still served";
  clients.front()->shutdownSend();
  EXPECT_TRUE(clients.front()->closes());
  EXPECT_EQ(get("/").result(), http::status::ok) << "a closed connection makes room";
}

}  // namespace
}  // namespace clothstream::tests
