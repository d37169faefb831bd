// SPDX-License-Identifier: MIT
// One WebSocket: forwards bytes between a socket and a session::Session.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/endpoint/web/endpoint_context.h"
#include "server/endpoint/web/web_stream.h"
#include "server/session/session.h"

namespace clothstream::endpoint {

// Belongs to the io thread. Lives while the endpoint's `streams` contains it or an operation of its socket is
// pending.
class WebSocketStream : public std::enable_shared_from_this<WebSocketStream> {
 public:
  WebSocketStream(WebStream&& stream, WebEndpointContext& endpoint, std::unique_ptr<ConnectionSlot> slot);

  void accept(boost::beast::http::request<boost::beast::http::empty_body>&& request);

  // Starts the closing handshake. The stream ends after it, at most kClosingTimeout later.
  void close(const boost::beast::websocket::close_reason& reason);

  // Releases the session. Its `wake` is not called after this returns.
  void leave() { session_.reset(); }

 private:
  // Ends the stream if `step` throws: it would wait for an operation that has not begun.
  template <class Step>
  void attempt(const Step& step);
  // Handler of an operation, which attempts `next` and keeps the stream alive until then.
  auto handler(void (WebSocketStream::*next)(boost::beast::error_code));
  // Opens the session.
  void onAccepted(boost::beast::error_code error);
  // Closes the connection of a client that sends too many frames, whatever their kind.
  void refuseFrames();
  void read();
  void onRead(boost::beast::error_code error);
  void onPauseEnded(boost::beast::error_code cancelled);
  // Writes the next message unless a write is under way.
  void pump();
  void onWritten(boost::beast::error_code error);
  // Ends the stream after kClosingTimeout, even if the client does not answer.
  void endSoon();
  void onClosingTimeout(boost::beast::error_code cancelled);
  void onClosed(boost::beast::error_code error);
  void end();

  WebEndpointContext& endpoint_;
  std::unique_ptr<ConnectionSlot> slot_;
  // No permessage-deflate, since frames are compressed already.
  boost::beast::websocket::stream<WebStream, false> socket_;
  boost::beast::http::request<boost::beast::http::empty_body> request_;
  boost::beast::flat_buffer incoming_;
  std::shared_ptr<session::Session> session_;
  delivery::SharedBytes outgoing_;
  boost::asio::steady_timer closingTimer_;
  boost::asio::steady_timer pauseTimer_;  // before the next read, of a client that sends too fast
  bool ending_ = false;                   // closingTimer_ runs
  bool writing_ = false;
  bool closing_ = false;
};

}  // namespace clothstream::endpoint
