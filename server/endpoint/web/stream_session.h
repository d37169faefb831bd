// SPDX-License-Identifier: MIT
// One WebSocket: moves bytes between a socket and a session::Session.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/empty_body.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "server/endpoint/web/endpoint_context.h"
#include "server/session/session.h"

namespace clothstream::endpoint {

// All on the io thread. Lives as long as it stands in the endpoint's `streams` or an operation of its socket
// is pending.
class StreamSession : public std::enable_shared_from_this<StreamSession> {
 public:
  StreamSession(boost::beast::tcp_stream&& socket, EndpointContext& endpoint,
                std::unique_ptr<ConnectionSlot> slot);

  void accept(boost::beast::http::request<boost::beast::http::empty_body>&& request);

  // The closing handshake, at most kClosingTimeout of it; then the session ends.
  void close(const boost::beast::websocket::close_reason& reason);

  // Gives the connection up; its `wake` is not called any more once this returns.
  void leave() { connection_.reset(); }

 private:
  void open();
  void read();
  void onRead(boost::beast::error_code error);
  // Writes the next message unless one is being written.
  void pump();
  void onWritten(boost::beast::error_code error);
  // Ends it in kClosingTimeout, whatever the peer does.
  void endSoon();
  void end();

  EndpointContext& endpoint_;
  std::unique_ptr<ConnectionSlot> slot_;
  // Without permessage-deflate: frames are compressed already.
  boost::beast::websocket::stream<boost::beast::tcp_stream, false> socket_;
  boost::beast::http::request<boost::beast::http::empty_body> request_;
  boost::beast::flat_buffer incoming_;
  std::shared_ptr<session::Session> connection_;
  delivery::SharedBytes outgoing_;
  boost::asio::steady_timer closingTimer_;
  bool ending_ = false;  // the timer runs
  bool writing_ = false;
  bool closing_ = false;
};

}  // namespace clothstream::endpoint
