// SPDX-License-Identifier: MIT
// One HTTP connection: answers one request and closes.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include "server/endpoint/web/host_names.h"
#include "server/monitoring/connection_room.h"

namespace clothstream::monitoring {

struct Answer {
  boost::beast::http::status status = boost::beast::http::status::ok;
  std::string contentType = "text/plain; charset=utf-8";
  std::string body;
};

class HttpConnection;

// State that all connections share. Belongs to the thread of the endpoint.
struct HttpContext {
  const endpoint::HostNames names;
  const std::function<Answer(std::string_view target)> answer;
  ConnectionRoom<HttpConnection> connections = {};
};

// Lives while an operation of its socket is pending. Each request takes at most kRequestTimeout to arrive,
// kResponseTimeout to be answered, and kCloseTimeout to close.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  static constexpr std::size_t kMaxHeaderBytes = 8 * 1024;
  static constexpr std::chrono::seconds kRequestTimeout{5}, kResponseTimeout{5}, kCloseTimeout{1};

  HttpConnection(boost::asio::ip::tcp::socket&& socket, HttpContext& context);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  void read();

 private:
  void onHeader(boost::beast::error_code error);
  Answer answer() const;
  void write(Answer&& answer);
  void close();
  void drain();

  HttpContext& context_;
  boost::beast::tcp_stream socket_;
  boost::beast::flat_buffer buffer_{kMaxHeaderBytes};
  boost::beast::http::request_parser<boost::beast::http::empty_body> parser_;
  boost::beast::http::response<boost::beast::http::string_body> response_;
};

}  // namespace clothstream::monitoring
