// SPDX-License-Identifier: MIT
#include "server/endpoint/web/http_connection.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <boost/beast/core/detect_ssl.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/write.hpp>
#include <boost/beast/websocket/rfc6455.hpp>

#include "server/endpoint/web/request_body.h"
#include "server/endpoint/web/web_socket_stream.h"
#include "server/hosting/scene_server.h"

namespace clothstream::endpoint {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
using namespace std::chrono_literals;

constexpr auto kHandshakeTimeout = 5s;  // of TLS
constexpr auto kRequestTimeout = 5s;    // for a whole header and between requests
constexpr auto kResponseTimeout = 30s;  // for a file over a slow link
constexpr auto kDrainTimeout = 1s;

std::string_view view(beast::string_view text) {
  return {text.data(), text.size()};
}

template <class Request>
auto plainAnswer(const Request& request, http::status status, std::string_view text) {
  http::response<http::span_body<const char>> response{status, request.version()};
  response.set(http::field::content_type, "text/plain; charset=utf-8");
  response.set(http::field::cache_control, "no-store");
  response.keep_alive(request.keep_alive());
  response.body() = {text.data(), text.size()};
  return response;
}

// Browsers send the origin of the page that opens a WebSocket. Other clients may send any origin or none, so
// the check protects only against pages.
template <class Request>
bool originAllowed(const Request& request, const std::vector<std::string>& allowed) {
  const auto field = request.find(http::field::origin);
  if (field == request.end()) return true;
  const std::string_view origin = view(field->value());
  const auto matches = [&](const std::string& entry) {
    return entry == "*" || beast::iequals(entry, field->value());
  };
  if (std::any_of(allowed.begin(), allowed.end(), matches)) return true;
  const std::size_t scheme = origin.find("://");
  if (scheme == std::string_view::npos) return false;
  const std::string_view authority = origin.substr(scheme + 3);
  return beast::iequals({authority.data(), authority.size()}, request[http::field::host]);
}

}  // namespace

HttpConnection::HttpConnection(boost::asio::ip::tcp::socket&& socket, WebEndpointContext& endpoint,
                               Admission::Ticket ticket)
    : endpoint_(endpoint),
      slot_(std::make_unique<ConnectionSlot>(endpoint, std::move(ticket))),
      beyondLimit_(endpoint.connections > endpoint.maxConnections),
      stream_(std::move(socket)) {}

void HttpConnection::start() {
  endpoint_.tls ? detectTls() : read();
}

void HttpConnection::detectTls() {
  stream_.next_layer().expires_after(kHandshakeTimeout);
  beast::async_detect_ssl(stream_.next_layer(), buffer_,
                          [self = shared_from_this()](beast::error_code error, bool isTls) {
                            if (!error) isTls ? self->shakeHands() : self->read();
                          });
}

void HttpConnection::shakeHands() {
  stream_.async_handshake(endpoint_.tls->context(), buffer_.data(),
                          [self = shared_from_this()](beast::error_code error, std::size_t used) {
                            if (error)
                              return self->endpoint_.server.metrics.refuse(telemetry::Refusal::handshake);
                            self->buffer_.consume(used);
                            self->read();
                          });
}

void HttpConnection::read() {
  parser_.emplace();
  parser_->header_limit(kMaxHeaderBytes);
  stream_.next_layer().expires_after(kRequestTimeout);
  http::async_read_header(
      stream_, buffer_, *parser_,
      [self = shared_from_this()](beast::error_code error, std::size_t) { self->onHeader(error); });
}

void HttpConnection::onHeader(beast::error_code error) {
  const auto refuse = [this](http::status status, std::string_view text) {
    Response response = plainAnswer(parser_->get(), status, text);
    response.keep_alive(false);
    write(std::move(response));
  };
  if (error == http::error::header_limit || error == http::error::buffer_overflow)
    return refuse(http::status::request_header_fields_too_large, "The header is larger than 16 KiB.\n");
  // All other values of http::error mean a malformed request, except the end of the connection.
  if (error.category() == http::make_error_code(http::error::end_of_stream).category() &&
      error != http::error::end_of_stream && error != http::error::partial_message)
    return refuse(http::status::bad_request, "This is not an HTTP request.\n");
  if (error) return;
  if (beyondLimit_)
    return refuse(http::status::service_unavailable, "The server has no free connection; try again later.\n");
  if (mayHaveBody(*parser_))
    return refuse(http::status::payload_too_large, "Requests must not have a body.\n");
  if (!endpoint_.names.contains(view(parser_->get()[http::field::host])))
    return refuse(
        http::status::misdirected_request,
        "This server does not have the name of the Host field. The server option --public-name adds it.\n");
  const std::string_view target = view(parser_->get().target());
  if (!target.starts_with('/'))
    return refuse(http::status::bad_request, "The target of a request must begin with '/'.\n");
  if (endpoint_.tls && !stream_.isEncrypted()) return write(redirection(parser_->get()));
  const bool isStream = target.substr(0, target.find('?')) == "/stream";
  // A connection becomes a WebSocket once, so the rate of connections limits these.
  if (isStream && beast::websocket::is_upgrade(parser_->get())) return answerStream(parser_->get());
  if (!endpoint_.requestRate.take(slot_->address(), schedule::Clock::now())) {
    endpoint_.server.metrics.refuse(telemetry::Refusal::requestRate);
    return refuse(http::status::too_many_requests, "Too many requests: try again in a second.\n");
  }
  write(isStream ? upgradeRequired(parser_->get()) : answer(parser_->get()));
}

void HttpConnection::answerStream(const Request& request) {
  if (!originAllowed(request, endpoint_.allowedOrigins)) {
    Response response = plainAnswer(
        request, http::status::forbidden,
        "Pages of this origin may not open /stream. The server option --allow-origin allows them.\n");
    response.keep_alive(false);
    return write(std::move(response));
  }
  stream_.next_layer().expires_never();  // the WebSocket sets its own timeouts
  std::make_shared<WebSocketStream>(std::move(stream_), endpoint_, std::move(slot_))
      ->accept(parser_->release());
}

HttpConnection::Response HttpConnection::upgradeRequired(const Request& request) const {
  Response response =
      plainAnswer(request, http::status::upgrade_required, "/stream accepts only WebSocket connections.\n");
  response.set(http::field::upgrade, "websocket");
  return response;
}

HttpConnection::Response HttpConnection::redirection(const Request& request) const {
  Response response = plainAnswer(request, http::status::permanent_redirect,
                                  "This server uses TLS: the address begins with https.\n");
  response.set(http::field::location,
               "https://" + std::string(request[http::field::host]) + std::string(request.target()));
  response.keep_alive(false);
  return response;
}

HttpConnection::Response HttpConnection::answer(const Request& request) const {
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    Response response =
        plainAnswer(request, http::status::method_not_allowed, "Only GET and HEAD are allowed.\n");
    response.set(http::field::allow, "GET, HEAD");
    return response;
  }
  const std::string_view target = view(request.target());
  if (target == "/healthz") return plainAnswer(request, http::status::ok, "ok");
  if (const PageFile* file = endpoint_.page.find(target)) return answerFile(request, *file);
  return plainAnswer(
      request, http::status::not_found,
      endpoint_.page.empty() ? "This server has no page; /stream is open.\n" : "There is no such file.\n");
}

HttpConnection::Response HttpConnection::answerFile(const Request& request, const PageFile& file) const {
  const bool known = view(request[http::field::if_none_match]).find(file.entityTag) != std::string_view::npos;
  Response response{known ? http::status::not_modified : http::status::ok, request.version()};
  // File names do not change between builds. So a browser may cache a file but must revalidate it.
  response.set(http::field::cache_control, "no-cache");
  response.set(http::field::etag, file.entityTag);
  response.set(http::field::content_type,
               beast::string_view(file.contentType.data(), file.contentType.size()));
  response.set("X-Content-Type-Options", "nosniff");
  // Another page that shows this one in a frame could make a person click on it without seeing it.
  response.set("Content-Security-Policy", "frame-ancestors 'none'");
  response.set("X-Frame-Options", "DENY");
  // Isolates the page, so that its threads may share memory.
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Embedder-Policy", "require-corp");
  response.keep_alive(request.keep_alive());
  if (!known) response.body() = {file.content.data(), file.content.size()};
  return response;
}

void HttpConnection::write(Response&& response) {
  response_ = std::move(response);
  response_.set(http::field::server, "clothstream");
  if (response_.result() != http::status::not_modified) response_.content_length(response_.body().size());
  if (parser_->get().method() == http::verb::head) response_.body() = {};
  endpoint_.server.metrics.webBytes.add(response_.body().size());
  stream_.next_layer().expires_after(kResponseTimeout);
  http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
    self->onWritten(error);
  });
}

void HttpConnection::onWritten(beast::error_code error) {
  if (error) return;
  if (response_.keep_alive()) return read();
  stream_.next_layer().expires_after(kDrainTimeout);
  stream_.async_end([self = shared_from_this()](beast::error_code) {
    if (!self->stream_.isEncrypted()) self->drain();
  });
}

// Reads the rest of the request: closing a socket with unread bytes resets the connection, and the reset may
// overtake the response.
void HttpConnection::drain() {
  buffer_.clear();
  stream_.async_read_some(buffer_.prepare(kMaxHeaderBytes),
                          [self = shared_from_this()](beast::error_code error, std::size_t) {
                            if (!error) self->drain();
                          });
}

}  // namespace clothstream::endpoint
