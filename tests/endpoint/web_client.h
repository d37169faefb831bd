// SPDX-License-Identifier: MIT
// HTTP and WebSocket clients for tests. Every step ends within kPatience.
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

#include "tests/endpoint/client.h"

namespace clothstream::tests {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

// Much longer than any answer takes, so that a test that hangs ends.
inline constexpr std::chrono::seconds kPatience{20};

using Response = http::response<http::string_body>;

// Thrown when nothing happens for kPatience, or a connection cannot be opened.
class ClientError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class HttpClient {
 public:
  explicit HttpClient(std::uint16_t port);

  // Sends the bytes unchanged; they include the header fields.
  void send(const std::string& bytes);
  // `fields` are lines such as "Origin: http://x\r\n". The response to HEAD has no body.
  Response get(const std::string& target, const std::string& fields = "", const std::string& method = "GET");
  Response readResponse(bool headOnly = false);
  // Whether the server closes without sending another byte.
  bool closes();
  // Reads until this text has come. Returns false if the connection ends before.
  bool receives(const std::string& text);
  void shutdownSend();

 private:
  net::io_context io_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
};

class WebSocketClient final : public Client {
 public:
  struct Handshake {
    std::string origin = {};
    std::string host = {};  // empty: the address
    std::string subprotocol = {};
    int receiveBufferBytes = 0;  // 0: the default of the system
  };

  explicit WebSocketClient(std::uint16_t port) : WebSocketClient(port, Handshake{}) {}
  // Throws ClientError with the server's HTTP status if it does not upgrade.
  WebSocketClient(std::uint16_t port, const Handshake& handshake);

  bool send(const std::string& message) override { return sendMessage(message, true); }
  std::optional<std::string> receive() override;
  StreamEnd end() override;
  // Sends a close frame and waits for the server's.
  void leave() override;
  void close(websocket::close_code code);
  // Resets the TCP connection.
  void disconnect() override;

  // Sends a text message, which the protocol does not allow.
  bool sendText(const std::string& message) { return sendMessage(message, false); }
  // Reads and answers pings, and sends nothing else. Returns false if the connection is still open after
  // `time`; then the client must not be used any more.
  bool closesWithin(std::chrono::steady_clock::duration time);
  const websocket::response_type& response() const { return response_; }
  // Closes the client's half of the TCP connection.
  void shutdownSend();

 private:
  bool sendMessage(const std::string& message, bool binary);

  net::io_context io_;
  websocket::stream<beast::tcp_stream, false> stream_;
  websocket::response_type response_;
  beast::flat_buffer buffer_;
};

}  // namespace clothstream::tests
