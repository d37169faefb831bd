// SPDX-License-Identifier: MIT
// The io_context runs only inside wait().
#include "clients/websocket/web_socket_transport.h"

#include <atomic>
#include <functional>
#include <memory>
#include <stdexcept>
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

// A connection and what has happened on it.
class Link final : private WebSocketListener {
 public:
  // `onEvent` is called, on the thread of the io_context, after each event.
  Link(WebSocketConnector& connector, std::string server, std::function<void()> onEvent)
      : server_(std::move(server)), onEvent_(std::move(onEvent)), connection_(connector.open(*this)) {}

  const std::string& server() const { return server_; }
  const std::optional<WebSocketEnd>& end() const { return end_; }
  bool hasOpened() const { return opened_; }
  bool canWrite() const { return opened_ && !end_ && !writing_ && !leaving_; }
  bool hasMessage() const { return message_.has_value(); }

  void write(std::span<const std::byte> message) {
    writing_ = true;
    connection_->write({reinterpret_cast<const char*>(message.data()), message.size()});
  }
  void leave() {
    if (!canWrite()) return;
    leaving_ = true;
    connection_->close();
  }
  void cancel() { connection_->cancel(); }
  std::string serverAddress() const { return opened_ && !end_ ? connection_->serverAddress() : ""; }
  std::optional<std::span<const std::byte>> receive() {
    if (message_ && !end_) connection_->read();
    return std::exchange(message_, std::nullopt);
  }

 private:
  void opened() override {
    opened_ = true;
    connection_->read();
    onEvent_();
  }
  void received(std::span<const std::byte> message) override {
    message_ = message;
    onEvent_();
  }
  void written() override {
    writing_ = false;
    onEvent_();
  }
  void ended(const WebSocketEnd& end) override {
    end_ = end;
    onEvent_();
  }

  const std::string server_;
  const std::function<void()> onEvent_;
  std::optional<WebSocketEnd> end_;
  std::optional<std::span<const std::byte>> message_;
  bool opened_ = false, writing_ = false, leaving_ = false;
  std::unique_ptr<WebSocketConnection> connection_;
};

class WebSocketTransport final : public Transport {
 public:
  explicit WebSocketTransport(const ServerAddress& address)
      : address_(address),
        current_(address),
        work_(net::make_work_guard(io_)),
        connector_(std::make_unique<WebSocketConnector>(io_, address)) {}

  void connect(const std::string& server) override {
    current_ = address_.at(server);
    if (prepared_ && !prepared_->end() && prepared_->server() == server) {
      link_ = std::move(prepared_);
      std::swap(connector_, spare_);
      return wake();  // it may be open already
    }
    if (prepared_ && !prepared_->end()) prepared_->cancel();
    link_.reset();
    connector_->goTo(current_);
    link_ = makeLink(*connector_, server);
  }
  // Does nothing while the connection prepared before ends.
  void prepare(const std::string& server) override {
    if (prepared_ && !prepared_->end()) {
      if (prepared_->server() != server) prepared_->cancel();
      return;
    }
    prepared_.reset();
    try {
      if (!spare_) spare_ = std::make_unique<WebSocketConnector>(io_, address_);
    } catch (const std::invalid_argument&) {
      return;  // the file of authorities is gone; the first connector has read it
    }
    spare_->goTo(address_.at(server));
    prepared_ = makeLink(*spare_, server);
  }
  bool active() const override { return link_ && (!link_->end() || link_->hasMessage()); }
  bool hasOpened() const override { return link_ && link_->hasOpened(); }
  bool canWrite() const override { return link_ && link_->canWrite(); }
  void write(std::span<const std::byte> message) override { link_->write(message); }
  void leave() override { link_->leave(); }
  void cancel() override { link_->cancel(); }
  std::string serverAddress() const override { return link_ ? link_->serverAddress() : ""; }

  void wait(std::chrono::steady_clock::duration atMost) override {
    const auto end = std::chrono::steady_clock::now() + atMost;
    happened_ = false;
    // Runs at least the handlers that are due.
    do io_.run_one_until(end);
    while (!happened_ && std::chrono::steady_clock::now() < end);
  }

  std::optional<std::span<const std::byte>> receive() override {
    return link_ ? link_->receive() : std::nullopt;
  }

  // At most one handler is posted.
  void wake() override {
    if (woken_.exchange(true)) return;
    net::post(io_, [this] {
      woken_ = false;
      happened_ = true;
    });
  }

  bool endedByServer() const override { return link_ && link_->end() && link_->end()->byServer; }
  Failure notJoined() const override;
  Failure lost() const override;

 private:
  std::unique_ptr<Link> makeLink(WebSocketConnector& connector, const std::string& server) {
    return std::make_unique<Link>(connector, server, [this] { happened_ = true; });
  }

  Failure notTrusted() const;
  Failure notUpgraded() const;

  const ServerAddress address_;
  ServerAddress current_;  // of the newest connection
  net::io_context io_;
  net::executor_work_guard<net::io_context::executor_type> work_;
  std::atomic<bool> woken_{false};
  std::unique_ptr<WebSocketConnector> connector_, spare_;  // of link_ and of prepared_
  std::unique_ptr<Link> link_;                             // the newest
  std::unique_ptr<Link> prepared_;
  bool happened_ = false;
};

Failure WebSocketTransport::notTrusted() const {
  const std::string text = "The server at " + current_.address + " is not the one expected: ";
  if (!current_.fingerprint.empty())
    return {Failure::Kind::refused, text + "it has the fingerprint " + link_->end()->shownKey +
                                        ". If this is right, use it; otherwise another server answers."};
  return {Failure::Kind::refused, text + "no known authority has signed its certificate for this name" +
                                      inBrackets(link_->end()->why) +
                                      ". Use the file of the authority that has, or the fingerprint of the "
                                      "server's key. This server shows the fingerprint " +
                                      link_->end()->shownKey + "."};
}

Failure WebSocketTransport::notUpgraded() const {
  const std::string status = std::to_string(link_->end()->httpStatus);
  if (link_->end()->httpStatus != 0 && link_->end()->isOurs)
    return {Failure::Kind::refused, "The server at " + current_.address + " refuses: " + link_->end()->why +
                                        " (HTTP status " + status + ")"};
  const std::string answer = link_->end()->httpStatus != 0
                                 ? "HTTP status " + status + inBrackets(link_->end()->why)
                                 : link_->end()->why;
  return {Failure::Kind::refused,
          "No clothstream-server of this release answers at " + current_.address + ", but something else: " +
              answer + ". Use the port of the server's page (--port, default 8080), and " +
              (current_.isEncrypted() ? "ws:// if it has no TLS." : "wss:// if it has TLS.")};
}

Failure WebSocketTransport::notJoined() const {
  using Kind = Failure::Kind;
  switch (link_->end()->stage) {
    case Stage::lookup:
      return {Kind::unreachable, "The name in the address " + current_.address + " is not known" +
                                     inBrackets(link_->end()->why) + ": check it, and the network."};
    case Stage::connect:
      return {Kind::unreachable, "No server answers at " + current_.address +
                                     ": is clothstream-server running there?" +
                                     inBrackets(link_->end()->why)};
    case Stage::tls:
      if (link_->end()->untrusted) return notTrusted();
      return {Kind::refused, "The server at " + current_.address + " does not answer with TLS" +
                                 inBrackets(link_->end()->why) + ". Use ws:// if it has no TLS."};
    case Stage::upgrade:
      return notUpgraded();
    case Stage::open:
      break;
  }
  if (link_->end()->byServer && !link_->end()->why.empty())
    return {Kind::refused, "The server at " + current_.address + " refuses: " + link_->end()->why};
  return {Kind::unreachable, "The server at " + current_.address +
                                 " ended the stream before the scene was described" +
                                 inBrackets(link_->end()->byServer ? "" : link_->end()->why) + "."};
}

Failure WebSocketTransport::lost() const {
  if (link_->end()->byServer && link_->end()->why.empty())
    return {Failure::Kind::lost, "The server at " + current_.address + " ended the stream."};
  return {Failure::Kind::lost,
          "The stream from " + current_.address + " is lost" + inBrackets(link_->end()->why) + "."};
}

}  // namespace

std::unique_ptr<Transport> makeWebSocketTransport(const ServerAddress& address) {
  return std::make_unique<WebSocketTransport>(address);
}

}  // namespace clothstream
