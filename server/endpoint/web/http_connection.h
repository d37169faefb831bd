// SPDX-License-Identifier: MIT
// One HTTP connection, with TLS if the endpoint has it: answers requests for the page until it closes, times
// out or becomes a WebSocket.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string_view>

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/span_body.hpp>

#include "server/endpoint/web/endpoint_context.h"
#include "server/endpoint/web/web_stream.h"

namespace clothstream::endpoint {

inline constexpr std::size_t kMaxHeaderBytes = 16 * 1024;

// Lives while an operation of its socket is pending. Belongs to the io thread.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(boost::asio::ip::tcp::socket&& socket, WebEndpointContext& endpoint,
                 Admission::Ticket ticket);

  void start();

 private:
  using Request = boost::beast::http::request<boost::beast::http::empty_body>;
  using Response = boost::beast::http::response<boost::beast::http::span_body<const char>>;

  // Only with TLS. A client that begins without it is redirected to https.
  void detectTls();
  void shakeHands();
  void read();
  void onHeader(boost::beast::error_code error);
  void answerStream(const Request& request);
  Response upgradeRequired(const Request& request) const;
  Response redirection(const Request& request) const;
  Response answer(const Request& request) const;
  Response answerFile(const Request& request, const PageFile& file) const;
  void write(Response&& response);
  void onWritten(boost::beast::error_code error);
  void drain();

  WebEndpointContext& endpoint_;
  std::unique_ptr<ConnectionSlot> slot_;
  const bool beyondLimit_;
  WebStream stream_;
  boost::beast::flat_buffer buffer_{kMaxHeaderBytes};
  std::optional<boost::beast::http::request_parser<boost::beast::http::empty_body>> parser_;
  Response response_;
};

}  // namespace clothstream::endpoint
