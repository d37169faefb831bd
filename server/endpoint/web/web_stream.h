// SPDX-License-Identifier: MIT
// A TCP connection with or without TLS, as an asynchronous stream of Beast.
#pragma once

#include <memory>
#include <utility>

#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>

namespace clothstream::endpoint {

// Begins without TLS. Belongs to the io thread.
class WebStream {
 public:
  using executor_type = boost::beast::tcp_stream::executor_type;
  using next_layer_type = boost::beast::tcp_stream;

  explicit WebStream(boost::asio::ip::tcp::socket&& socket)
      : plain_(std::make_unique<boost::beast::tcp_stream>(std::move(socket))) {}

  // The server's part of a handshake. `received` holds what was read already; the handler gets an error and
  // the number of these bytes that were used.
  template <typename ConstBuffers, typename Handler>
  void async_handshake(std::shared_ptr<boost::asio::ssl::context> context, const ConstBuffers& received,
                       Handler&& handler) {
    context_ = std::move(context);
    tls_ = std::make_unique<Tls>(std::move(*plain_), *context_);
    plain_.reset();
    tls_->async_handshake(boost::asio::ssl::stream_base::server, received, std::forward<Handler>(handler));
  }

  // Tells the peer that nothing more follows. Without TLS the handler is called at once.
  template <typename Handler>
  void async_end(Handler&& handler) {
    if (tls_) return tls_->async_shutdown(std::forward<Handler>(handler));
    boost::beast::error_code error;
    plain_->socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
    std::forward<Handler>(handler)(error);
  }

  bool isEncrypted() const { return tls_ != nullptr; }

  // The connection itself, for its timeouts and addresses.
  next_layer_type& next_layer() { return tls_ ? tls_->next_layer() : *plain_; }
  const next_layer_type& next_layer() const { return tls_ ? tls_->next_layer() : *plain_; }
  executor_type get_executor() { return next_layer().get_executor(); }

  template <typename MutableBuffers, typename Handler>
  auto async_read_some(const MutableBuffers& buffers, Handler&& handler) {
    return tls_ ? tls_->async_read_some(buffers, std::forward<Handler>(handler))
                : plain_->async_read_some(buffers, std::forward<Handler>(handler));
  }
  template <typename ConstBuffers, typename Handler>
  auto async_write_some(const ConstBuffers& buffers, Handler&& handler) {
    return tls_ ? tls_->async_write_some(buffers, std::forward<Handler>(handler))
                : plain_->async_write_some(buffers, std::forward<Handler>(handler));
  }

  // Used by websocket::stream after its closing handshake.
  template <typename Handler>
  friend void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
    using boost::beast::async_teardown;
    using boost::beast::websocket::async_teardown;
    if (stream.tls_)
      async_teardown(role, *stream.tls_, std::forward<Handler>(handler));
    else
      async_teardown(role, *stream.plain_, std::forward<Handler>(handler));
  }

 private:
  using Tls = boost::beast::ssl_stream<boost::beast::tcp_stream>;

  std::shared_ptr<boost::asio::ssl::context> context_;  // used by tls_; a reload may have replaced it
  std::unique_ptr<boost::beast::tcp_stream> plain_;     // without TLS
  std::unique_ptr<Tls> tls_;                            // with TLS
};

}  // namespace clothstream::endpoint
