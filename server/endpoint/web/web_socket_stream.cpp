// SPDX-License-Identifier: MIT
#include "server/endpoint/web/web_socket_stream.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <string_view>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/http/rfc7230.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/endpoint/listen/address_rate.h"
#include "server/endpoint/web/frame_meter.h"
#include "server/hosting/scene_server.h"
#include "server/session/closing.h"
#include "server/session/wake.h"

namespace clothstream::endpoint {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace ws = beast::websocket;
using namespace std::chrono_literals;

constexpr const char* kSubprotocol = "clothstream.v1";
// Close code of a page that may return: scripts cannot send ws::close_code::going_away.
constexpr std::uint16_t kMayReturn = 4001;
constexpr auto kUpgradeTimeout = 2s;
constexpr auto kClosingTimeout = 2s;
// After half of this time without a byte the server sends a ping; after all of it the client counts as
// vanished.
constexpr auto kIdleTimeout = 4s;
// RFC 6455 5.5: a control frame holds 125 bytes, of which the code takes two.
constexpr std::size_t kMaxCloseText = 123;

session::Arrival arrivalOf(const beast::tcp_stream& socket) {
  beast::error_code error;
  const auto endpoint = socket.socket().remote_endpoint(error);
  // The address of a connection that has ended already is unknown; it must not count as this machine.
  if (error) return {.peer = "web", .address = "unknown", .token = {}};
  const auto own = socket.socket().local_endpoint(error);
  return {.peer = fmt::format("web {}:{}", endpoint.address().to_string(), endpoint.port()),
          .address = addressKey(endpoint.address()),
          .token = {},
          .reached = error ? std::string() : plainText(own.address())};
}

// Longest prefix of `text` that fits into a close frame and does not cut a UTF-8 sequence.
std::string_view closeText(std::string_view text) {
  std::size_t size = std::min(text.size(), kMaxCloseText);
  while (size < text.size() && size > 0 && (static_cast<unsigned char>(text[size]) & 0xC0) == 0x80) --size;
  return text.substr(0, size);
}

ws::close_reason reasonOf(const session::Closing& closing) {
  const std::string_view text = closeText(closing.text);
  const bool isError = closing.reason == session::Closing::Reason::error;
  return {isError ? ws::close_code::policy_error : ws::close_code::going_away,
          beast::string_view(text.data(), text.size())};
}

}  // namespace

template <class Step>
void WebSocketStream::attempt(const Step& step) {
  try {
    step();
  } catch (const std::exception& failure) {
    spdlog::error("page: a stream ends: {}", failure.what());
    end();
  }
}

auto WebSocketStream::handler(void (WebSocketStream::*next)(beast::error_code)) {
  return [self = shared_from_this(), next](beast::error_code error, std::size_t = 0) {
    self->attempt([&] { (self.get()->*next)(error); });
  };
}

WebSocketStream::WebSocketStream(WebStream&& stream, WebEndpointContext& endpoint,
                                 std::unique_ptr<ConnectionSlot> slot)
    : endpoint_(endpoint),
      slot_(std::move(slot)),
      socket_(std::move(stream)),
      closingTimer_(endpoint.io),
      pauseTimer_(endpoint.io) {
  socket_.binary(true);
  socket_.auto_fragment(false);
  socket_.read_message_max(session::kMaxClientMessageBytes);
  socket_.set_option(ws::stream_base::timeout{kUpgradeTimeout, kIdleTimeout, true});
}

void WebSocketStream::accept(http::request<http::empty_body>&& request) {
  request_ = std::move(request);
  const bool speaksOurs =
      http::token_list(request_[http::field::sec_websocket_protocol]).exists(kSubprotocol);
  socket_.set_option(ws::stream_base::decorator([speaksOurs](ws::response_type& response) {
    response.set(http::field::server, "clothstream");
    if (speaksOurs) response.set(http::field::sec_websocket_protocol, kSubprotocol);
  }));
  socket_.async_accept(request_, handler(&WebSocketStream::onAccepted));
}

void WebSocketStream::onAccepted(beast::error_code error) {
  if (error || endpoint_.stopping) return;
  endpoint_.streams.insert(shared_from_this());
  auto wake = session::wakeOf(
      weak_from_this(), [&io = endpoint_.io](auto task) { boost::asio::post(io, std::move(task)); },
      [](WebSocketStream& self) { self.attempt([&] { self.pump(); }); });
  session_ =
      session::Session::open(endpoint_.server, arrivalOf(beast::get_lowest_layer(socket_)), std::move(wake));
  socket_.next_layer().limitFrames([&io = endpoint_.io, weak = weak_from_this()] {
    boost::asio::post(io, [weak] {
      if (const auto self = weak.lock()) self->attempt([&] { self->refuseFrames(); });
    });
  });
  read();
  pump();
}

void WebSocketStream::refuseFrames() {
  if (closing_) return;
  telemetry::ServerMetrics& metrics = endpoint_.server.metrics;
  metrics.refuse(telemetry::Refusal::messageRate);
  metrics.droppedConnections.add();
  close({ws::close_code::policy_error,
         fmt::format("too many WebSocket frames: send at most {:.0f} small ones per second",
                     FrameMeter::kSmallFramesPerSecond)});
}

void WebSocketStream::read() {
  socket_.async_read(incoming_, handler(&WebSocketStream::onRead));
}

void WebSocketStream::onRead(beast::error_code error) {
  // Only a close frame is a goodbye. All other errors mean a lost connection. After its close frame, a client
  // may cut the connection without the end of TLS, as WinHTTP under Wine does: then the error is another one.
  const std::uint16_t code = socket_.reason().code;
  if (error && (error == ws::error::closed || code != ws::close_code::none) && session_) {
    if (code == ws::close_code::going_away || code == kMayReturn)
      session_->closePage();
    else
      session_->leave();
  }
  if (error) return end();
  if (closing_ || !session_) return;
  if (socket_.got_text())
    return close({ws::close_code::unknown_data, "messages must be binary, one ClientMessage each"});
  session_->receive({static_cast<const std::byte*>(incoming_.cdata().data()), incoming_.size()});
  incoming_.consume(incoming_.size());
  const schedule::Clock::duration pause = session_->readPause();
  if (pause <= schedule::Clock::duration::zero()) return read();
  pauseTimer_.expires_after(pause);
  pauseTimer_.async_wait(handler(&WebSocketStream::onPauseEnded));
}

void WebSocketStream::onPauseEnded(beast::error_code cancelled) {
  if (!cancelled && !closing_) read();
}

void WebSocketStream::pump() {
  if (closing_ || !session_) return;
  const bool finished = session_->finished();  // checked before next(), so that no message is lost
  if (writing_) {
    if (finished) endSoon();
  } else if (std::optional<delivery::SharedBytes> message = session_->next()) {
    outgoing_ = std::move(*message);
    writing_ = true;
    endpoint_.server.metrics.webBytes.add(outgoing_->size());
    socket_.async_write(boost::asio::buffer(outgoing_->data(), outgoing_->size()),
                        handler(&WebSocketStream::onWritten));
  } else if (finished) {
    close(reasonOf(session::closingOf(outgoing_)));
  }
}

void WebSocketStream::onWritten(beast::error_code error) {
  writing_ = false;
  // A close frame or a timeout aborted the write. The read that is under way reports which.
  if (error == boost::asio::error::operation_aborted) return;
  if (error) return end();
  pump();
}

void WebSocketStream::close(const ws::close_reason& reason) {
  if (std::exchange(closing_, true)) return;
  leave();
  endSoon();
  socket_.async_close(reason, handler(&WebSocketStream::onClosed));
}

void WebSocketStream::onClosed(beast::error_code) {
  end();
}

void WebSocketStream::endSoon() {
  if (std::exchange(ending_, true)) return;
  closingTimer_.expires_after(kClosingTimeout);
  closingTimer_.async_wait(handler(&WebSocketStream::onClosingTimeout));
}

void WebSocketStream::onClosingTimeout(beast::error_code cancelled) {
  if (!cancelled) end();
}

void WebSocketStream::end() {
  closing_ = true;
  leave();
  closingTimer_.cancel();
  pauseTimer_.cancel();
  beast::get_lowest_layer(socket_).close();
  endpoint_.streams.erase(shared_from_this());
  if (endpoint_.stopping && endpoint_.streams.empty()) endpoint_.io.stop();
}

}  // namespace clothstream::endpoint
