// SPDX-License-Identifier: MIT
// The io_context runs only inside wait().
#include "clients/websocket/web_socket_transport.h"

#include <atomic>
#include <string>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include "clients/websocket/web_socket_connection.h"

namespace clothstream {
namespace {

namespace net = boost::asio;
using Stage = WebSocketEnd::Stage;

std::string inBrackets(const std::string& text) {
  return text.empty() ? text : " (" + text + ")";
}

class WebSocketTransport final : public Transport, private WebSocketListener {
 public:
  explicit WebSocketTransport(const ServerAddress& address)
      : address_(address), current_(address), work_(net::make_work_guard(io_)), connector_(io_, address) {}

  void connect(const std::string& server) override {
    end_.reset();
    message_.reset();
    open_ = opened_ = writing_ = leaving_ = false;
    current_ = address_.at(server);
    connection_.reset();
    connector_.goTo(current_);
    connection_ = connector_.open(*this);
  }
  bool active() const override { return connection_ && (!end_ || message_); }
  bool hasOpened() const override { return opened_; }
  bool canWrite() const override { return open_ && !writing_ && !leaving_; }

  void write(std::span<const std::byte> message) override {
    writing_ = true;
    connection_->write({reinterpret_cast<const char*>(message.data()), message.size()});
  }
  void leave() override {
    if (!canWrite()) return;
    leaving_ = true;
    connection_->close();
  }
  void cancel() override { connection_->cancel(); }

  void wait(std::chrono::steady_clock::duration atMost) override {
    const auto end = std::chrono::steady_clock::now() + atMost;
    happened_ = false;
    // Runs at least the handlers that are due.
    do io_.run_one_until(end);
    while (!happened_ && std::chrono::steady_clock::now() < end);
  }

  std::optional<std::span<const std::byte>> receive() override {
    if (message_ && !end_) connection_->read();
    return std::exchange(message_, std::nullopt);
  }

  // At most one handler is posted.
  void wake() override {
    if (woken_.exchange(true)) return;
    net::post(io_, [this] {
      woken_ = false;
      happened_ = true;
    });
  }

  bool endedByServer() const override { return end_ && end_->byServer; }
  Failure notJoined() const override;
  Failure lost() const override;

 private:
  void opened() override {
    open_ = opened_ = happened_ = true;
    connection_->read();
  }
  void received(std::span<const std::byte> message) override {
    message_ = message;
    happened_ = true;
  }
  void written() override {
    writing_ = false;
    happened_ = true;
  }
  void ended(const WebSocketEnd& end) override {
    end_ = end;
    open_ = false;
    happened_ = true;
  }

  Failure notTrusted() const;
  Failure notUpgraded() const;

  const ServerAddress address_;
  ServerAddress current_;  // of the newest connection
  net::io_context io_;
  net::executor_work_guard<net::io_context::executor_type> work_;
  std::atomic<bool> woken_{false};
  WebSocketConnector connector_;
  std::unique_ptr<WebSocketConnection> connection_;  // the newest
  std::optional<WebSocketEnd> end_;                  // of the newest connection
  std::optional<std::span<const std::byte>> message_;
  bool open_ = false, opened_ = false, writing_ = false, leaving_ = false, happened_ = false;
};

Failure WebSocketTransport::notTrusted() const {
  const std::string text = "The server at " + current_.address + " is not the one expected: ";
  if (!current_.fingerprint.empty())
    return {Failure::Kind::refused, text + "it has the fingerprint " + end_->shownKey +
                                        ". If this is right, use it; otherwise another server answers."};
  return {Failure::Kind::refused, text + "no known authority has signed its certificate for this name" +
                                      inBrackets(end_->why) +
                                      ". Use the file of the authority that has, or the fingerprint of the "
                                      "server's key. This server shows the fingerprint " +
                                      end_->shownKey + "."};
}

Failure WebSocketTransport::notUpgraded() const {
  const std::string status = std::to_string(end_->httpStatus);
  if (end_->httpStatus != 0 && end_->isOurs)
    return {Failure::Kind::refused,
            "The server at " + current_.address + " refuses: " + end_->why + " (HTTP status " + status + ")"};
  const std::string answer =
      end_->httpStatus != 0 ? "HTTP status " + status + inBrackets(end_->why) : end_->why;
  return {Failure::Kind::refused,
          "No clothstream-server of this release answers at " + current_.address + ", but something else: " +
              answer + ". Use the port of the server's page (--port, default 8080), and " +
              (current_.isEncrypted() ? "ws:// if it has no TLS." : "wss:// if it has TLS.")};
}

Failure WebSocketTransport::notJoined() const {
  using Kind = Failure::Kind;
  switch (end_->stage) {
    case Stage::lookup:
      return {Kind::unreachable, "The name in the address " + current_.address + " is not known" +
                                     inBrackets(end_->why) + ": check it, and the network."};
    case Stage::connect:
      return {Kind::unreachable, "No server answers at " + current_.address +
                                     ": is clothstream-server running there?" + inBrackets(end_->why)};
    case Stage::tls:
      if (end_->untrusted) return notTrusted();
      return {Kind::refused, "The server at " + current_.address + " does not answer with TLS" +
                                 inBrackets(end_->why) + ". Use ws:// if it has no TLS."};
    case Stage::upgrade:
      return notUpgraded();
    case Stage::open:
      break;
  }
  if (end_->byServer && !end_->why.empty())
    return {Kind::refused, "The server at " + current_.address + " refuses: " + end_->why};
  return {Kind::unreachable, "The server at " + current_.address +
                                 " ended the stream before the scene was described" +
                                 inBrackets(end_->byServer ? "" : end_->why) + "."};
}

Failure WebSocketTransport::lost() const {
  if (end_->byServer && end_->why.empty())
    return {Failure::Kind::lost, "The server at " + current_.address + " ended the stream."};
  return {Failure::Kind::lost,
          "The stream from " + current_.address + " is lost" + inBrackets(end_->why) + "."};
}

}  // namespace

std::unique_ptr<Transport> makeWebSocketTransport(const ServerAddress& address) {
  return std::make_unique<WebSocketTransport>(address);
}

}  // namespace clothstream
