// SPDX-License-Identifier: MIT
#include "server/monitoring/http_connection.h"

#include <utility>

#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>

#include "server/endpoint/listen/address_rate.h"
#include "server/endpoint/web/request_body.h"

namespace clothstream::monitoring {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

HttpConnection::HttpConnection(boost::asio::ip::tcp::socket&& socket, HttpContext& context)
    : context_(context), socket_(std::move(socket)) {
  parser_.header_limit(kMaxHeaderBytes);
  beast::error_code unknown;  // of a peer that has disconnected; it counts as a separate address
  const auto peer = socket_.socket().remote_endpoint(unknown);
  if (HttpConnection* const crowded = context_.connections.add(*this, endpoint::addressKey(peer.address())))
    crowded->socket_.close();  // the operation that is under way then ends, and with it the connection
}

HttpConnection::~HttpConnection() {
  context_.connections.remove(*this);
}

void HttpConnection::read() {
  socket_.expires_after(kRequestTimeout);
  http::async_read_header(
      socket_, buffer_, parser_,
      [self = shared_from_this()](beast::error_code error, std::size_t) { self->onHeader(error); });
}

void HttpConnection::onHeader(beast::error_code error) {
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return write(
        {.status = http::status::request_header_fields_too_large, .body = "The header is too large.\n"});
  // All other values of http::error mean a malformed request, except the end of the connection.
  if (error.category() == http::make_error_code(http::error::end_of_stream).category() &&
      error != http::error::end_of_stream && error != http::error::partial_message)
    return write({.status = http::status::bad_request, .body = "This is not an HTTP request.\n"});
  if (!error) write(answer());
}

Answer HttpConnection::answer() const {
  const auto& request = parser_.get();
  if (endpoint::mayHaveBody(parser_))
    return {.status = http::status::payload_too_large, .body = "Requests must not have a body.\n"};
  if (!context_.names.contains(view(request[http::field::host])))
    return {.status = http::status::misdirected_request,
            .body =
                "This server does not have the name of the Host field. The server option --public-name "
                "adds it.\n"};
  if (request.method() != http::verb::get && request.method() != http::verb::head)
    return {.status = http::status::method_not_allowed, .body = "Only GET and HEAD are allowed.\n"};
  return context_.answer(view(request.target()));
}

void HttpConnection::write(Answer&& answer) {
  response_ = {answer.status, 11};
  response_.set(http::field::server, "clothstream");
  response_.set(http::field::content_type, answer.contentType);
  response_.set(http::field::cache_control, "no-store");
  if (answer.status == http::status::method_not_allowed) response_.set(http::field::allow, "GET, HEAD");
  response_.keep_alive(false);
  response_.content_length(answer.body.size());
  if (parser_.get().method() != http::verb::head) response_.body() = std::move(answer.body);
  socket_.expires_after(kResponseTimeout);
  http::async_write(socket_, response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    if (!error) self->close();
  });
}

void HttpConnection::close() {
  beast::error_code ignored;
  socket_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
  socket_.expires_after(kCloseTimeout);
  drain();
}

// Reads the rest of the request: closing a socket with unread bytes resets the connection, and the reset may
// overtake the response.
void HttpConnection::drain() {
  buffer_.clear();
  socket_.async_read_some(buffer_.prepare(kMaxHeaderBytes),
                          [self = shared_from_this()](beast::error_code error, std::size_t) {
                            if (!error) self->drain();
                          });
}

}  // namespace clothstream::monitoring
