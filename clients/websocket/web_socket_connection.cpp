// SPDX-License-Identifier: MIT
// Lookup, TCP, TLS, upgrade and messages, by Boost.Beast.
#include "clients/websocket/web_socket_connection.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/error.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "clients/native/transport.h"
#include "clients/websocket/host_lookup.h"
#include "clients/websocket/server_trust.h"
#include "proto/text/printable.h"

namespace clothstream {

namespace net = boost::asio;
namespace ssl = net::ssl;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using beast::error_code;
using net::ip::tcp;
using Stage = WebSocketEnd::Stage;

struct WebSocketConnector::Shared {
  Shared(net::io_context& context, const ServerAddress& address)
      : io(context), server(address), lookup(std::in_place, io, server.host(), server.port()) {
    if (server.isEncrypted()) trust.emplace(server);
  }
  void goTo(const ServerAddress& address) {
    if (address.address == server.address) return;
    server = address;
    lookup.emplace(io, server.host(), server.port());
    if (trust) trust->expect(server.host());
  }

  net::io_context& io;
  ServerAddress server;
  std::optional<HostLookup> lookup;
  std::optional<ServerTrust> trust;  // with TLS
};

namespace {

// Longest time from the start to the end of TLS, and of the upgrade.
constexpr std::chrono::seconds kHandshakeTimeout{10};
// Longest text of an HTTP answer that is shown.
constexpr std::size_t kMaxShownText = 300;

using Plain = beast::tcp_stream;
using Encrypted = beast::ssl_stream<beast::tcp_stream>;

// First line of a text from outside.
std::string firstLine(std::string_view text) {
  return printable(text.substr(0, std::min(text.find_first_of("\r\n"), kMaxShownText)));
}

std::string_view textOf(beast::string_view text) {
  return {text.data(), text.size()};
}

// Layer is Plain or Encrypted. Shared is that of the connector.
template <typename Layer, typename Shared>
class Connection final : public WebSocketConnection {
 public:
  Connection(Shared& shared, WebSocketListener& listener)
      : shared_(shared), listener_(listener), stream_(makeLayer(shared)) {
    shared_.lookup->find([this, alive = std::weak_ptr<bool>(alive_)](error_code error, const auto& found) {
      if (alive.expired() || ended_) return;
      if (error) return end(error);
      connect(found);
    });
  }

  void read() override {
    if (ended_) return;
    reading_ = true;
    stream_.async_read(incoming_, tracked([this](std::size_t) {
                         reading_ = false;
                         const auto bytes = incoming_.cdata();
                         swap(message_, incoming_);
                         incoming_.clear();
                         listener_.received({static_cast<const std::byte*>(bytes.data()), bytes.size()});
                       }));
  }
  void write(std::string message) override {
    if (ended_) return;
    outgoing_ = std::move(message);
    ++underway_;
    stream_.async_write(net::buffer(outgoing_), [this](error_code error, std::size_t) {
      --underway_;
      // A read that is under way fails too, and tells why: a close frame of the server aborts the write.
      if (error && !reading_) end(error);
      if (!error && !ended_) listener_.written();
      finish();
    });
  }
  void close() override {
    if (ended_) return;
    // Completes when the server has answered with its close frame.
    stream_.async_close(websocket::close_code::normal, tracked([this] { end({}); }));
  }
  void cancel() override { end(net::error::operation_aborted); }
  std::string serverAddress() const override {
    error_code unknown;
    const tcp::endpoint server = beast::get_lowest_layer(stream_).socket().remote_endpoint(unknown);
    return unknown ? std::string() : server.address().to_string();
  }

 private:
  static Layer makeLayer(Shared& shared) {
    if constexpr (std::is_same_v<Layer, Encrypted>)
      return Encrypted(shared.io, shared.trust->context());
    else
      return Plain(shared.io);
  }

  // Counts a handler until it has run. The connection exists at least as long.
  template <class Handler>
  auto tracked(Handler handler) {
    ++underway_;
    return [this, handler](error_code error, auto&&... rest) {
      if (error)
        end(error);
      else if (!ended_)
        handler(rest...);
      --underway_;
      finish();
    };
  }

  void connect(const HostLookup::Found& found) {
    stage_ = Stage::connect;
    lowest().expires_after(kHandshakeTimeout);
    lowest().async_connect(found, tracked([this](auto&&...) { secure(); }));
  }
  void secure() {
    error_code ignored;
    lowest().socket().set_option(tcp::no_delay(true), ignored);
    if constexpr (std::is_same_v<Layer, Encrypted>) {
      stage_ = Stage::tls;
      std::string host = shared_.server.host();
      error_code isName;
      net::ip::make_address(host, isName);
      // SSL_set_tlsext_host_name(), which is a macro with an old-style cast. RFC 6066 allows only names.
      if (isName)
        SSL_ctrl(stream_.next_layer().native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME,
                 TLSEXT_NAMETYPE_host_name, host.data());
      stream_.next_layer().async_handshake(ssl::stream_base::client, tracked([this] { upgrade(); }));
    } else {
      upgrade();
    }
  }
  void upgrade() {
    stage_ = Stage::upgrade;
    lowest().expires_never();
    // The client's own pings find a silent connection; the server's pings are answered while it reads.
    stream_.set_option(
        websocket::stream_base::timeout{kHandshakeTimeout, websocket::stream_base::none(), false});
    stream_.binary(true);
    stream_.auto_fragment(false);
    stream_.read_message_max(kMaxServerMessageBytes);
    stream_.async_handshake(response_, shared_.server.hostAndPort(), "/stream", tracked([this] {
                              stage_ = Stage::open;
                              listener_.opened();
                            }));
  }

  auto& lowest() { return beast::get_lowest_layer(stream_); }

  void end(error_code error) {
    if (std::exchange(ended_, true)) return;
    alive_.reset();
    end_.stage = stage_;
    end_.why = error.message();
    if (stage_ == Stage::tls && error.category() == net::error::get_ssl_category()) {
      end_.shownKey = shownKey();
      end_.untrusted =
          ERR_GET_REASON(static_cast<unsigned long>(error.value())) == SSL_R_CERTIFICATE_VERIFY_FAILED;
    } else if (stage_ == Stage::upgrade && error == websocket::error::upgrade_declined) {
      end_.httpStatus = static_cast<int>(response_.result_int());
      end_.isOurs = response_[beast::http::field::server] == "clothstream";
      end_.why = firstLine(end_.isOurs ? std::string_view(response_.body()) : textOf(response_.reason()));
    } else if (stage_ == Stage::open && (!error || error == websocket::error::closed)) {
      end_.byServer = true;
      end_.why = firstLine(stream_.reason().reason.c_str());
    }
    lowest().close();
    finish();
  }
  std::string shownKey() const {
    if constexpr (std::is_same_v<Layer, Encrypted>) return shared_.trust->shown();
    return {};
  }
  // Nothing may follow ended() in the same handler, because it may destroy the connection.
  void finish() {
    if (!ended_ || underway_ > 0 || std::exchange(told_, true)) return;
    net::post(shared_.io, [this] { listener_.ended(end_); });
  }

  Shared& shared_;
  WebSocketListener& listener_;
  websocket::stream<Layer, false> stream_;  // without compression
  websocket::response_type response_;
  beast::flat_buffer incoming_, message_;
  std::string outgoing_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
  int underway_ = 0;
  Stage stage_ = Stage::lookup;
  WebSocketEnd end_;
  bool reading_ = false, ended_ = false, told_ = false;
};

}  // namespace

WebSocketConnector::WebSocketConnector(net::io_context& io, const ServerAddress& server)
    : shared_(std::make_unique<Shared>(io, server)) {}

WebSocketConnector::~WebSocketConnector() = default;

void WebSocketConnector::goTo(const ServerAddress& server) {
  shared_->goTo(server);
}

std::unique_ptr<WebSocketConnection> WebSocketConnector::open(WebSocketListener& listener) {
  if (shared_->trust) return std::make_unique<Connection<Encrypted, Shared>>(*shared_, listener);
  return std::make_unique<Connection<Plain, Shared>>(*shared_, listener);
}

}  // namespace clothstream
