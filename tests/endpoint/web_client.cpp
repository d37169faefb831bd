// SPDX-License-Identifier: MIT
#include "tests/endpoint/web_client.h"

#include <array>

#include <boost/asio/write.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>

namespace clothstream::tests {
namespace {

using net::ip::tcp;

// Runs one asynchronous operation to its end. `start` begins it with the given handler.
template <class Start>
beast::error_code await(net::io_context& io, Start&& start) {
  std::optional<beast::error_code> result;
  start([&result](beast::error_code error, auto&&...) { result = error; });
  io.restart();
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (!result && io.run_one_until(deadline) > 0) {
  }
  if (!result) throw ClientError("nothing happened for " + std::to_string(kPatience.count()) + " s");
  return *result;
}

void mustSucceed(beast::error_code error, const char* what) {
  if (error) throw ClientError(std::string(what) + ": " + error.message());
}

void connect(net::io_context& io, beast::tcp_stream& stream, std::uint16_t port, int receiveBufferBytes = 0) {
  const tcp::endpoint server(net::ip::address_v4::loopback(), port);
  stream.socket().open(tcp::v4());
  if (receiveBufferBytes > 0)
    stream.socket().set_option(net::socket_base::receive_buffer_size(receiveBufferBytes));
  mustSucceed(await(io, [&](auto handler) { stream.async_connect(server, handler); }), "connect");
}

}  // namespace

HttpClient::HttpClient(std::uint16_t port) : stream_(io_) {
  connect(io_, stream_, port);
}

void HttpClient::send(const std::string& bytes) {
  mustSucceed(await(io_, [&](auto handler) { net::async_write(stream_, net::buffer(bytes), handler); }),
              "send");
}

Response HttpClient::get(const std::string& target, const std::string& fields, const std::string& method) {
  send(method + " " + target + " HTTP/1.1\r\nHost: localhost\r\n" + fields + "\r\n");
  return readResponse(method == "HEAD");
}

Response HttpClient::readResponse(bool headOnly) {
  http::response_parser<http::string_body> parser;
  parser.skip(headOnly);
  mustSucceed(await(io_, [&](auto handler) { http::async_read(stream_, buffer_, parser, handler); }),
              "response");
  return parser.release();
}

bool HttpClient::closes() {
  char byte = 0;
  return buffer_.size() == 0 &&
         await(io_, [&](auto handler) { stream_.async_read_some(net::buffer(&byte, 1), handler); }).failed();
}

bool HttpClient::receives(const std::string& text) {
  std::string all = beast::buffers_to_string(buffer_.cdata());
  while (all.find(text) == std::string::npos) {
    std::array<char, 4096> bytes{};
    std::size_t count = 0;
    const beast::error_code error = await(io_, [&](auto handler) {
      stream_.async_read_some(net::buffer(bytes),
                              [&count, handler](beast::error_code ended, std::size_t got) {
                                count = got;
                                handler(ended);
                              });
    });
    if (error) return false;
    all.append(bytes.data(), count);
  }
  return true;
}

void HttpClient::shutdownSend() {
  stream_.socket().shutdown(tcp::socket::shutdown_send);
}

WebSocketClient::WebSocketClient(std::uint16_t port, const Handshake& handshake) : stream_(io_) {
  connect(io_, stream_.next_layer(), port, handshake.receiveBufferBytes);
  const std::string host = handshake.host.empty() ? "127.0.0.1:" + std::to_string(port) : handshake.host;
  stream_.binary(true);
  stream_.read_message_max(0);
  stream_.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
    if (!handshake.origin.empty()) request.set(http::field::origin, handshake.origin);
    if (!handshake.subprotocol.empty())
      request.set(http::field::sec_websocket_protocol, handshake.subprotocol);
  }));
  const beast::error_code error =
      await(io_, [&](auto handler) { stream_.async_handshake(response_, host, "/stream", handler); });
  if (error == websocket::error::upgrade_declined)
    throw ClientError("declined with " + std::to_string(response_.result_int()));
  mustSucceed(error, "handshake");
}

bool WebSocketClient::sendMessage(const std::string& message, bool binary) {
  stream_.binary(binary);
  return !await(io_, [&](auto handler) { stream_.async_write(net::buffer(message), handler); });
}

std::optional<std::string> WebSocketClient::receive() {
  const beast::error_code error = await(io_, [&](auto handler) { stream_.async_read(buffer_, handler); });
  if (error) return std::nullopt;
  std::string message = beast::buffers_to_string(buffer_.cdata());
  buffer_.consume(buffer_.size());
  return message;
}

StreamEnd WebSocketClient::end() {
  const websocket::close_reason& reason = stream_.reason();
  return {reason.code, reason.reason.c_str()};
}

bool WebSocketClient::closesWithin(std::chrono::steady_clock::duration time) {
  bool closed = false;
  const std::function<void()> read = [&] {
    stream_.async_read(buffer_, [&](beast::error_code error, std::size_t) {
      closed = error.failed();
      buffer_.consume(buffer_.size());
      if (!closed) read();
    });
  };
  read();
  io_.restart();
  const auto deadline = std::chrono::steady_clock::now() + time;
  while (!closed && io_.run_one_until(deadline) > 0) {
  }
  return closed;
}

void WebSocketClient::leave() {
  close(websocket::close_code::normal);
}

void WebSocketClient::close(websocket::close_code code) {
  await(io_, [&](auto handler) { stream_.async_close(code, handler); });
}

void WebSocketClient::disconnect() {
  tcp::socket& socket = stream_.next_layer().socket();
  socket.set_option(net::socket_base::linger(true, 0));
  socket.close();
}

void WebSocketClient::shutdownSend() {
  stream_.next_layer().socket().shutdown(tcp::socket::shutdown_send);
}

}  // namespace clothstream::tests
