// SPDX-License-Identifier: MIT
// A TCP connection with or without TLS, as an asynchronous stream of Beast. Counts the frames of a WebSocket.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <type_traits>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/compose.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>

#include "server/endpoint/web/frame_meter.h"
#include "server/schedule/clock.h"

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

  // From now on the bytes are those of a WebSocket. `exceeded` is called once, during a read, if its frames
  // exceed the limits of FrameMeter. Later reads wait until the connection is closed, and then fail.
  void limitFrames(std::function<void()> exceeded) {
    frames_ = std::make_unique<Frames>(Frames{.meter = {}, .exceeded = std::move(exceeded)});
  }

  template <typename MutableBuffers, typename Handler>
  auto async_read_some(const MutableBuffers& buffers, Handler&& handler) {
    if (!frames_) return readSome(buffers, std::forward<Handler>(handler));
    return boost::asio::async_compose<std::remove_reference_t<Handler>,
                                      void(boost::beast::error_code, std::size_t)>(
        CountingRead<MutableBuffers>{*this, buffers}, handler, next_layer());
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
  struct Frames {
    FrameMeter meter;
    std::function<void()> exceeded;
  };

  template <typename MutableBuffers, typename Handler>
  auto readSome(const MutableBuffers& buffers, Handler&& handler) {
    return tls_ ? tls_->async_read_some(buffers, std::forward<Handler>(handler))
                : plain_->async_read_some(buffers, std::forward<Handler>(handler));
  }

  // Reads, and counts the frames in what was read.
  template <typename MutableBuffers>
  class CountingRead {
   public:
    CountingRead(WebStream& stream, const MutableBuffers& buffers) : stream_(stream), buffers_(buffers) {}

    template <typename Self>
    void operator()(Self& self, boost::beast::error_code error = {}, std::size_t bytes = 0) {
      WebStream& stream = stream_;  // `self` holds this, and is moved
      switch (std::exchange(state_, stream.frames_->meter.exceeded() ? State::stopped : State::reading)) {
        case State::begins: {
          const MutableBuffers buffers = buffers_;
          if (state_ == State::reading) return stream.readSome(buffers, std::move(self));
          auto& socket = stream.next_layer().socket();
          return socket.async_wait(boost::asio::socket_base::wait_error, std::move(self));
        }
        case State::reading:
          stream.count(buffers_, bytes);
          return self.complete(error, bytes);
        case State::stopped:
          return self.complete(boost::asio::error::operation_aborted, 0);
      }
    }

   private:
    enum class State : std::uint8_t { begins, reading, stopped };
    WebStream& stream_;
    MutableBuffers buffers_;
    State state_ = State::begins;
  };

  template <typename MutableBuffers>
  void count(const MutableBuffers& buffers, std::size_t bytes) {
    const auto now = schedule::Clock::now();
    for (auto part = boost::asio::buffer_sequence_begin(buffers);
         bytes > 0 && part != boost::asio::buffer_sequence_end(buffers); ++part) {
      const boost::asio::const_buffer piece = boost::asio::buffer(*part, bytes);
      bytes -= piece.size();
      if (!frames_->meter.add({static_cast<const std::byte*>(piece.data()), piece.size()}, now))
        return frames_->exceeded();
    }
  }

  std::shared_ptr<boost::asio::ssl::context> context_;  // used by tls_; a reload may have replaced it
  std::unique_ptr<boost::beast::tcp_stream> plain_;     // without TLS
  std::unique_ptr<Tls> tls_;                            // with TLS
  std::unique_ptr<Frames> frames_;                      // null before it is a WebSocket
};

}  // namespace clothstream::endpoint
