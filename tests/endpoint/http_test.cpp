// SPDX-License-Identifier: MIT
// The page over HTTP, with requests good and bad.
#include <memory>
#include <vector>

#include <gmock/gmock.h>

#include "server/endpoint/web/web_endpoint.h"
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

class HttpEndpoint : public EndpointTest {
 protected:
  void SetUp() override {
    EndpointTest::SetUp();
    if (IsSkipped()) return;
    files.write("index.html", "<html>cloth</html>");
    files.write("core.wasm", std::string("\0asm", 4));
    files.writeOutside("secret.txt", "secret");
    open({});
  }
  void TearDown() override {
    endpoint.reset();
    EndpointTest::TearDown();
  }
  void open(endpoint::WebEndpointOptions options) {
    endpoint.reset();
    options.port = 0;
    options.pageDirectory = files.path();
    endpoint = std::make_unique<endpoint::WebEndpoint>(server(), options);
  }
  Response get(const std::string& target, const std::string& fields = "", const std::string& method = "GET") {
    return HttpClient(endpoint->port()).get(target, fields, method);
  }

  PageDirectory files;
  std::unique_ptr<endpoint::WebEndpoint> endpoint;
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

TEST_F(HttpEndpoint, AnswersSeveralRequestsOnOneConnection) {
  HttpClient client(endpoint->port());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(client.get("/").result(), http::status::ok);
  client.send("GET / HTTP/1.1\r\nHost: a\r\n\r\nGET /healthz HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_EQ(client.readResponse().body(), "<html>cloth</html>");
  EXPECT_EQ(client.readResponse().body(), "ok");
}

TEST_F(HttpEndpoint, HeadTellsTheSizeWithoutTheContent) {
  HttpClient client(endpoint->port());
  const Response head = client.get("/", "", "HEAD");
  EXPECT_EQ(head.result(), http::status::ok);
  EXPECT_EQ(field(head, http::field::content_length), "18");
  EXPECT_EQ(client.get("/healthz").body(), "ok");  // nothing of a body lies in between
}

TEST_F(HttpEndpoint, AFileThatTheBrowserHasIsNotSentAgain) {
  const Response first = get("/core.wasm");
  EXPECT_EQ(field(first, http::field::cache_control), "no-cache");
  HttpClient client(endpoint->port());
  const Response again =
      client.get("/core.wasm", "If-None-Match: " + field(first, http::field::etag) + "\r\n");
  EXPECT_EQ(again.result(), http::status::not_modified);
  EXPECT_EQ(again.body(), "");
  EXPECT_EQ(client.get("/core.wasm", "If-None-Match: \"old\"\r\n").result(), http::status::ok);
}

TEST_F(HttpEndpoint, AnUnknownPathIsNotFound) {
  EXPECT_EQ(get("/nothing.js").result(), http::status::not_found);
}

TEST_F(HttpEndpoint, NothingOutsideThePageIsServed) {
  for (const char* target : {"/../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "/./../secret.txt",
                             "//etc/passwd", "/%2fetc/passwd"}) {
    const Response response = get(target);
    EXPECT_EQ(response.result(), http::status::not_found) << target;
    EXPECT_THAT(response.body(), testing::Not(HasSubstr("secret"))) << target;
  }
}

TEST_F(HttpEndpoint, OtherMethodsAreRefusedByName) {
  const Response response = get("/", "", "DELETE");
  EXPECT_EQ(response.result(), http::status::method_not_allowed);
  EXPECT_EQ(field(response, http::field::allow), "GET, HEAD");
}

TEST_F(HttpEndpoint, ABodyIsRefusedWithoutReadingIt) {
  HttpClient client(endpoint->port());
  client.send("POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 1000000\r\n\r\n" + std::string(20'000, 'x'));
  EXPECT_EQ(client.readResponse().result(), http::status::payload_too_large);
  EXPECT_EQ(get("/", "Transfer-Encoding: chunked\r\n", "POST").result(), http::status::payload_too_large);
}

TEST_F(HttpEndpoint, AHugeHeaderIsRefused) {
  const Response response = get("/", "X-Huge: " + std::string(17 * 1024, 'x') + "\r\n");
  EXPECT_EQ(response.result(), http::status::request_header_fields_too_large);
}

TEST_F(HttpEndpoint, GarbageIsABadRequestAndTheConnectionCloses) {
  HttpClient client(endpoint->port());
  client.send("\x16\x03\x01 this is no HTTP\r\n\r\n");
  EXPECT_EQ(client.readResponse().result(), http::status::bad_request);
  EXPECT_TRUE(client.closes());
  EXPECT_EQ(get("/").result(), http::status::ok);
}

TEST_F(HttpEndpoint, ClosesAConnectionThatNeverFinishesItsHeader) {
  HttpClient client(endpoint->port());
  client.send("GET / HTTP/1.1\r\nHost: a\r\n");
  EXPECT_TRUE(client.closes());  // by the server's time-out; nothing else ends this wait
}

TEST_F(HttpEndpoint, TellsThatItIsHealthy) {
  const Response response = get("/healthz");
  EXPECT_EQ(response.result(), http::status::ok);
  EXPECT_EQ(response.body(), "ok");
}

TEST_F(HttpEndpoint, ThePathOfTheStreamWantsAWebSocket) {
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

TEST_F(HttpEndpoint, OneConnectionMoreThanTheLimitIsToldSo) {
  endpoint::WebEndpointOptions options;
  options.maxConnections = 3;
  open(options);
  std::vector<std::unique_ptr<HttpClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<HttpClient>(endpoint->port()));
    EXPECT_EQ(clients.back()->get("/healthz").result(), http::status::ok);
  }
  EXPECT_EQ(get("/").result(), http::status::service_unavailable);
  EXPECT_EQ(clients.front()->get("/").result(), http::status::ok) << "those that are open are served on";
  clients.front()->shutdownSend();
  EXPECT_TRUE(clients.front()->closes());
  EXPECT_EQ(get("/").result(), http::status::ok) << "one that closed makes room";
}

TEST_F(HttpEndpoint, APortInUseSaysWhatToDo) {
  endpoint::WebEndpointOptions options;
  options.port = endpoint->port();
  EXPECT_THAT([&] { endpoint::WebEndpoint(server(), options); },
              testing::ThrowsMessage<std::runtime_error>(
                  "port " + std::to_string(endpoint->port()) +
                  " on 127.0.0.1 is already in use: choose another with --port"));
}

TEST_F(HttpEndpoint, AHostOfAnotherMachineIsNamed) {
  endpoint::WebEndpointOptions options;
  options.host = "192.0.2.1";  // RFC 5737: documentation, nobody's
  options.port = 0;
  EXPECT_THAT(
      [&] { endpoint::WebEndpoint(server(), options); },
      testing::ThrowsMessage<std::runtime_error>(HasSubstr("cannot listen on port 0 of 192.0.2.1: ")));
}

}  // namespace
}  // namespace clothstream::tests
