// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/http_target.h"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <sys/socket.h>
#include <unistd.h>

#include "inputs.pb.h"
#include "server/endpoint/web/endpoint_context.h"
#include "server/endpoint/web/http_connection.h"
#include "server/endpoint/web/web_socket_stream.h"
#include "server/session/session.h"
#include "tests/fuzz/targets/still_server.h"

namespace clothstream::fuzz {
namespace {

namespace net = boost::asio;

constexpr int kMaxSteps = 64;

// Files of the page: any few files that every working copy has.
constexpr const char* kPage = "tests/fuzz/dictionaries";

std::string bytesOf(const HttpInput::Request& request) {
  std::string text = request.method() + ' ' + request.target() + " HTTP/1.1\r\n";
  if (!request.without_host()) text += "Host: localhost\r\n";
  for (const HttpInput::Field& field : request.fields()) text += field.name() + ": " + field.value() + "\r\n";
  return text + "\r\n";
}

std::string bytesOf(const HttpInput::WebSocketFrame& frame) {
  const std::string payload = frame.has_message() ? frame.message().SerializeAsString() : frame.payload();
  const std::size_t size = payload.size();
  std::string bytes;
  const auto add = [&](std::size_t byte) { bytes += static_cast<char>(byte & 0xff); };
  add((frame.final() ? 0x80u : 0u) | (frame.opcode() & 0x7fu));
  const std::size_t mask = frame.unmasked() ? 0u : 0x80u;
  if (size < 126) {
    add(mask | size);
  } else if (size < 65'536) {
    add(mask | 126);
    for (const unsigned shift : {8u, 0u}) add(size >> shift);
  } else {
    add(mask | 127);
    for (unsigned shift = 64; shift > 0; shift -= 8) add(std::uint64_t{size} >> (shift - 8));
  }
  if (!frame.unmasked()) bytes += std::string(4, '\0');  // a mask of zeros leaves the payload as it is
  return bytes + payload;
}

std::string bytesOf(const HttpInput::Step& step) {
  using Step = HttpInput::Step;
  switch (step.sent_case()) {
    case Step::kRaw:
      return step.raw();
    case Step::kRequest:
      return bytesOf(step.request());
    case Step::kUpgrade:
      return "GET /stream HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
             "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: clothstream.v1\r\n"
             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    case Step::kFrame:
      return bytesOf(step.frame());
    case Step::SENT_NOT_SET:
      break;
  }
  return {};
}

// Connection with the endpoint's end as a socket of its type. The io context runs only here.
class Connection {
 public:
  Connection() {
    std::array<int, 2> ends{};
    require(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()) == 0,
            "there is a free socket");
    client_ = ends[0];
    net::ip::tcp::socket socket(io_);
    socket.assign(net::ip::tcp::v4(), ends[1]);
    auto ticket = admission_.admit(net::ip::make_address("127.0.0.1"), schedule::Clock::now());
    require(ticket.has_value(), "the connection is admitted");
    std::make_shared<endpoint::HttpConnection>(std::move(socket), context_, std::move(*ticket))->start();
  }
  ~Connection() {
    ::close(client_);
    poll();
    for (const auto& stream : context_.streams) stream->leave();
    context_.streams.clear();
    poll();
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  // Returns false if the endpoint has closed the connection, or does not take more.
  bool send(const std::string& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      const ::ssize_t more = ::send(client_, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (more <= 0) return false;
      sent += static_cast<std::size_t>(more);
      poll();
    }
    return true;
  }
  void read() {
    std::array<char, 16'384> answer{};
    while (::recv(client_, answer.data(), answer.size(), 0) > 0) poll();
  }

 private:
  void poll() {
    io_.restart();
    io_.poll();
  }

  // `context_` outlives the sockets, which end with `io_`.
  endpoint::Admission admission_{{.connections = 4}};
  net::io_context* const ioPointer_ = &io_;
  endpoint::WebEndpointContext context_{.server = stillServer(),
                                        .io = *ioPointer_,
                                        .page = endpoint::Page(kPage),
                                        .names = endpoint::HostNames({}),
                                        .tls = nullptr,
                                        .allowedOrigins = {},
                                        .maxConnections = 4,
                                        .streams = {}};
  net::io_context io_{1};
  int client_ = -1;
};

void run(const HttpInput& input) {
  Connection connection;
  int steps = 0;
  for (const HttpInput::Step& step : input.steps()) {
    if (++steps > kMaxSteps || !connection.send(bytesOf(step))) break;
    if (!input.never_reads()) connection.read();
  }
}

constexpr std::array<std::string_view, 40> kWords{"GET",
                                                  "HEAD",
                                                  "POST",
                                                  "/",
                                                  "/stream",
                                                  "/healthz",
                                                  "/obj.dict",
                                                  "/../inputs.proto",
                                                  "/%2e%2e/inputs.proto",
                                                  "/obj.dict?x=1",
                                                  "/%00",
                                                  "/%",
                                                  "*",
                                                  "Host",
                                                  "localhost",
                                                  "127.0.0.1",
                                                  "[::1]",
                                                  "Origin",
                                                  "http://localhost",
                                                  "null",
                                                  "Connection",
                                                  "Upgrade",
                                                  "keep-alive",
                                                  "close",
                                                  "websocket",
                                                  "Sec-WebSocket-Key",
                                                  "Sec-WebSocket-Version",
                                                  "13",
                                                  "Sec-WebSocket-Protocol",
                                                  "clothstream.v1",
                                                  "Sec-WebSocket-Extensions",
                                                  "permessage-deflate",
                                                  "Content-Length",
                                                  "0",
                                                  "Transfer-Encoding",
                                                  "chunked",
                                                  "Expect",
                                                  "100-continue",
                                                  "If-None-Match",
                                                  "\"\""};

}  // namespace

const Target kHttpTarget{.name = "http",
                         .run = &runStructured<HttpInput, &run>,
                         .structure = &HttpInput::default_instance(),
                         .words = kWords};

}  // namespace clothstream::fuzz
