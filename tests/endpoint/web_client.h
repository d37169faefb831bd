// SPDX-License-Identifier: MIT
// Real HTTP and WebSocket clients for tests, every step of which ends within a time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/fields.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "tests/endpoint/viewer.h"

namespace clothstream::tests {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

// Far beyond what any answer takes, so that a test that hangs ends.
inline constexpr std::chrono::seconds kPatience{20};

using Response = http::response<http::string_body>;

// Thrown by the clients when nothing happens for kPatience, or a connection cannot be made.
class ClientError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class HttpClient {
 public:
  explicit HttpClient(std::uint16_t port);

  // The bytes as they are, complete with header fields.
  void send(const std::string& bytes);
  // `fields` are lines such as "Origin: http://x\r\n". The answer of a HEAD has no body.
  Response get(const std::string& target, const std::string& fields = "", const std::string& method = "GET");
  Response readResponse(bool headOnly = false);
  // True if the server closes without another byte.
  bool closes();
  void shutdownSend();

 private:
  net::io_context io_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
};

class WebSocketClient {
 public:
  struct Handshake {
    std::string origin = {};
    std::string subprotocol = {};
    int receiveBufferBytes = 0;  // 0: the system's choice
  };

  explicit WebSocketClient(std::uint16_t port) : WebSocketClient(port, Handshake{}) {}
  // Throws ClientError with the server's HTTP status if it does not upgrade.
  WebSocketClient(std::uint16_t port, const Handshake& handshake);

  // False if the connection is broken.
  bool send(const std::string& message, bool binary = true);
  // One message; nullopt when the server closes, for which closeReason() says why.
  std::optional<std::string> receive();
  // Receives until `done`, answering as a polite client does; false when the server closes first.
  bool watch(Viewer& viewer, const std::function<bool()>& done);
  // Reads and answers pings, but says nothing else. False if it is still open then; nothing may be asked of
  // it any more.
  bool closesWithin(std::chrono::steady_clock::duration time);
  websocket::close_reason closeReason() const { return stream_.reason(); }
  const websocket::response_type& response() const { return response_; }
  // Says goodbye with a close frame.
  void close();
  // Goes away without a word.
  void reset();
  // Says at TCP's level that nothing more will come.
  void shutdownSend();

 private:
  net::io_context io_;
  websocket::stream<beast::tcp_stream, false> stream_;
  websocket::response_type response_;
  beast::flat_buffer buffer_;
};

}  // namespace clothstream::tests
