// SPDX-License-Identifier: MIT
// Links over WebSockets. One thread serves all of them.
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include "clients/load/link.h"
#include "clients/websocket/web_socket_connection.h"

namespace clothstream::load {
namespace {

namespace net = boost::asio;

// Members belong to the thread of the Links, except those that the mutex guards.
class WebLink final : public Link, private WebSocketListener {
 public:
  WebLink(net::io_context& io, WebSocketConnector& connector, LinkListener& listener)
      : io_(io), listener_(listener) {
    net::post(io_, [this, &connector] { connection_ = connector.open(*this); });
  }

  void read() override {
    net::post(io_, [this] {
      wantsRead_ = true;
      readNext();
    });
  }
  void send(std::string message) override {
    net::post(io_, [this, message = std::move(message)]() mutable {
      if (leaving_ || ended_) return;
      waiting_.push_back(std::move(message));
      writeNext();
    });
  }
  void leave() override {
    net::post(io_, [this] {
      leaving_ = true;
      waiting_.clear();
      writeNext();
    });
  }
  // Later than every task that was posted before.
  void drop() override {
    net::post(io_, [this] {
      dropped_ = true;
      connection_->cancel();
      if (ended_) tellGone();
    });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return gone_; });
  }

 private:
  void opened() override {
    open_ = true;
    readNext();
    writeNext();
  }
  void received(std::span<const std::byte> message) override {
    reading_ = false;
    listener_.received(message);
  }
  void written() override {
    writing_ = false;
    writeNext();
  }
  void ended(const WebSocketEnd& end) override {
    ended_ = true;
    listener_.closed(end.why);
    if (dropped_) tellGone();
  }

  void readNext() {
    if (!open_ || ended_ || reading_ || !wantsRead_) return;
    reading_ = true;
    wantsRead_ = false;
    connection_->read();
  }
  void writeNext() {
    if (!open_ || ended_ || writing_ || closing_) return;
    if (waiting_.empty()) {
      if (!leaving_) return;
      closing_ = true;
      return connection_->close();
    }
    writing_ = true;
    connection_->write(std::move(waiting_.front()));
    waiting_.pop_front();
  }
  void tellGone() {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    changed_.notify_all();
  }

  net::io_context& io_;
  LinkListener& listener_;
  std::unique_ptr<WebSocketConnection> connection_;
  std::deque<std::string> waiting_;
  bool open_ = false, reading_ = false, writing_ = false, wantsRead_ = false;
  bool leaving_ = false, closing_ = false, ended_ = false, dropped_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool gone_ = false;  // guarded by the mutex
};

class WebLinks final : public Links {
 public:
  explicit WebLinks(const ServerAddress& server)
      : connector_(io_, server), work_(net::make_work_guard(io_)), thread_([this] { io_.run(); }) {}
  ~WebLinks() override {
    work_.reset();
    thread_.join();
  }
  std::unique_ptr<Link> open(LinkListener& listener) override {
    return std::make_unique<WebLink>(io_, connector_, listener);
  }

 private:
  net::io_context io_;
  WebSocketConnector connector_;
  net::executor_work_guard<net::io_context::executor_type> work_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Links> makeWebLinks(const ServerAddress& address) {
  return std::make_unique<WebLinks>(address);
}

}  // namespace clothstream::load
