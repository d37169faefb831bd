// SPDX-License-Identifier: MIT
// Links over WebSockets. One thread serves all of them.
#include <atomic>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>
#include <type_traits>
#include <utility>

#include <boost/asio/connect.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "clients/load/link.h"
#include "proto/tls/fingerprint.h"

namespace clothstream::load {
namespace {

// Largest message that is read, as with gRPC.
constexpr std::size_t kMaxMessageBytes = std::size_t{256} << 20;

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;
using net::ip::tcp;

struct Address {
  std::string host, port;

  explicit Address(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    host = text.substr(0, colon);
    port = text.substr(colon + 1);
    if (host.starts_with('[')) host = host.substr(1, host.size() - 2);
  }
};

using Plain = beast::tcp_stream;
using Encrypted = beast::ssl_stream<beast::tcp_stream>;

ssl::context contextFor(const ServerAddress& server) {
  ssl::context context(ssl::context::tls_client);
  context.set_verify_mode(ssl::verify_peer);
  if (!server.fingerprint.empty()) {
    context.set_verify_callback([fingerprint = server.fingerprint](bool, ssl::verify_context& shown) {
      X509* const certificate = X509_STORE_CTX_get_current_cert(shown.native_handle());
      return X509_STORE_CTX_get_error_depth(shown.native_handle()) > 0 ||
             fingerprintOf(*certificate) == fingerprint;
    });
    return context;
  }
  if (server.caFile.empty())
    context.set_default_verify_paths();
  else
    context.load_verify_file(server.caFile);
  context.set_verify_callback(ssl::host_name_verification(Address(server.hostAndPort()).host));
  return context;
}

// Transport is Plain or Encrypted. Members belong to the thread of the Links, except underway_ and those that
// the mutex guards.
template <typename Transport>
class WebLink final : public Link {
 public:
  // `context` is used for Encrypted.
  WebLink(net::io_context& io, ssl::context& context, const Address& address, LinkListener& listener)
      : io_(io), address_(address), listener_(listener), resolver_(io), stream_(makeTransport(io, context)) {
    post([this] { resolve(); });
  }

  void read() override {
    post([this] {
      wantsRead_ = true;
      readNext();
    });
  }
  void send(std::string message) override {
    post([this, message = std::move(message)]() mutable {
      if (leaving_ || ended_) return;
      waiting_.push_back(std::move(message));
      writeNext();
    });
  }
  void leave() override {
    post([this] {
      leaving_ = true;
      waiting_.resize(writing_ ? 1 : 0);
      writeNext();
    });
  }
  void drop() override {
    post([this] {
      end(net::error::operation_aborted);
      dropped_ = true;
    });
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return gone_; });
  }

 private:
  static Transport makeTransport(net::io_context& io, ssl::context& context) {
    if constexpr (std::is_same_v<Transport, Encrypted>)
      return Encrypted(io, context);
    else
      return Plain(io);
  }

  // Counts a task until it has run. The link exists at least as long.
  template <class Task>
  void post(Task task) {
    ++underway_;
    net::post(io_, [this, task = std::move(task)]() mutable {
      task();
      finished();
    });
  }
  template <class Handler>
  auto tracked(Handler handler) {
    ++underway_;
    return [this, handler](error_code error, auto&&... rest) {
      if (error)
        end(error);
      else if (!ended_)
        handler(rest...);
      finished();
    };
  }

  void resolve() {
    if (ended_) return;
    resolver_.async_resolve(address_.host, address_.port,
                            tracked([this](const tcp::resolver::results_type& found) { connect(found); }));
  }
  void connect(const tcp::resolver::results_type& found) {
    beast::get_lowest_layer(stream_).async_connect(found, tracked([this](auto&&...) { shakeHands(); }));
  }
  void shakeHands() {
    beast::get_lowest_layer(stream_).socket().set_option(tcp::no_delay(true));
    if constexpr (std::is_same_v<Transport, Encrypted>) {
      // SSL_set_tlsext_host_name(), which is a macro with an old-style cast.
      std::string host = address_.host;
      SSL_ctrl(stream_.next_layer().native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name,
               host.data());
      stream_.next_layer().async_handshake(ssl::stream_base::client, tracked([this] { upgrade(); }));
    } else {
      upgrade();
    }
  }
  void upgrade() {
    stream_.binary(true);
    stream_.read_message_max(kMaxMessageBytes);
    stream_.async_handshake(address_.host + ":" + address_.port, "/stream", tracked([this] {
                              open_ = true;
                              readNext();
                              writeNext();
                            }));
  }
  void readNext() {
    if (!open_ || ended_ || reading_ || !wantsRead_) return;
    reading_ = true;
    wantsRead_ = false;
    stream_.async_read(incoming_, tracked([this](std::size_t) {
                         reading_ = false;
                         const auto bytes = incoming_.cdata();
                         listener_.received({static_cast<const std::byte*>(bytes.data()), bytes.size()});
                         incoming_.clear();
                       }));
  }
  void writeNext() {
    if (!open_ || ended_ || writing_ || closing_) return;
    if (waiting_.empty()) {
      if (!leaving_) return;
      closing_ = true;
      // Completes when the server has answered with its close frame; reads continue until then.
      stream_.async_close(websocket::close_code::normal, tracked([this] { end({}); }));
      return;
    }
    writing_ = true;
    stream_.async_write(net::buffer(waiting_.front()), tracked([this](std::size_t) {
                          writing_ = false;
                          waiting_.pop_front();
                          writeNext();
                        }));
  }

  void end(error_code error) {
    if (ended_) return;
    ended_ = true;
    why_ = error == websocket::error::closed ? std::string(stream_.reason().reason.c_str()) : error.message();
    resolver_.cancel();
    beast::get_lowest_layer(stream_).close();
  }
  void finished() {
    if (--underway_ > 0 || !ended_) return;
    if (!std::exchange(toldClosed_, true)) listener_.closed(why_);
    if (!dropped_) return;
    const std::lock_guard lock(mutex_);
    gone_ = true;
    changed_.notify_all();
  }

  net::io_context& io_;
  const Address address_;
  LinkListener& listener_;
  tcp::resolver resolver_;
  websocket::stream<Transport> stream_;
  beast::flat_buffer incoming_;
  std::deque<std::string> waiting_;
  std::string why_;
  std::atomic<int> underway_ = 0;
  bool open_ = false, reading_ = false, writing_ = false, wantsRead_ = false;
  bool leaving_ = false, closing_ = false;
  bool ended_ = false, toldClosed_ = false, dropped_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool gone_ = false;  // guarded by the mutex
};

class WebLinks final : public Links {
 public:
  explicit WebLinks(const ServerAddress& server)
      : address_(server.hostAndPort()),
        encrypted_(server.isEncrypted()),
        context_(contextFor(server)),
        work_(net::make_work_guard(io_)),
        thread_([this] { io_.run(); }) {}
  ~WebLinks() override {
    work_.reset();
    thread_.join();
  }
  std::unique_ptr<Link> open(LinkListener& listener) override {
    if (encrypted_) return std::make_unique<WebLink<Encrypted>>(io_, context_, address_, listener);
    return std::make_unique<WebLink<Plain>>(io_, context_, address_, listener);
  }

 private:
  const Address address_;
  const bool encrypted_;
  ssl::context context_;
  net::io_context io_;
  net::executor_work_guard<net::io_context::executor_type> work_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Links> makeWebLinks(const ServerAddress& address) {
  return std::make_unique<WebLinks>(address);
}

}  // namespace clothstream::load
