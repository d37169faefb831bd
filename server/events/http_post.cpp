// SPDX-License-Identifier: MIT
// Lookup, TCP, TLS, request and answer, by Boost.Beast.
#include "server/events/http_post.h"

#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <type_traits>

#include <boost/asio/ip/address.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/host_name_verification.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>

namespace clothstream::events {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace ssl = asio::ssl;
using asio::ip::tcp;
using beast::error_code;

using Plain = beast::tcp_stream;
using Encrypted = beast::ssl_stream<beast::tcp_stream>;
using Request = http::request<http::string_body>;

// One request over Plain or Encrypted. Its handlers keep it alive.
template <class Stream>
class Exchange : public std::enable_shared_from_this<Exchange<Stream>> {
 public:
  template <class... Arguments>
  Exchange(const Url& url, PostTimeouts timeouts, Request request, HttpPost::Done done,
           Arguments&... arguments)
      : url_(url),
        timeouts_(timeouts),
        request_(std::move(request)),
        done_(std::move(done)),
        stream_(arguments...) {
    parser_.body_limit(std::numeric_limits<std::uint64_t>::max());  // the body is not read
  }

  void start(const tcp::resolver::results_type& found) {
    lowest().expires_after(timeouts_.connect);
    lowest().async_connect(found, [self = this->shared_from_this()](error_code error, const tcp::endpoint&) {
      if (error) return self->fail("connecting", error);
      self->secure();
    });
  }

 private:
  void secure() {
    if constexpr (std::is_same_v<Stream, Encrypted>) {
      error_code isName;
      asio::ip::make_address(url_.host, isName);
      // SSL_set_tlsext_host_name(), which is a macro with an old-style cast. RFC 6066 allows only names.
      if (isName)
        SSL_ctrl(stream_.native_handle(), SSL_CTRL_SET_TLSEXT_HOSTNAME, TLSEXT_NAMETYPE_host_name,
                 url_.host.data());
      stream_.set_verify_callback(ssl::host_name_verification(url_.host));
      stream_.async_handshake(ssl::stream_base::client, [self = this->shared_from_this()](error_code error) {
        if (error) return self->fail("TLS", error);
        self->write();
      });
    } else {
      write();
    }
  }
  void write() {
    lowest().expires_after(timeouts_.answer);
    http::async_write(stream_, request_, [self = this->shared_from_this()](error_code error, std::size_t) {
      // The receiver may have answered before it has read everything.
      self->read(error);
    });
  }
  void read(error_code written) {
    http::async_read_header(
        stream_, buffer_, parser_, [self = this->shared_from_this(), written](error_code error, std::size_t) {
          if (error)
            return self->fail(written ? "sending" : "waiting for the answer", written ? written : error);
          self->done_({.status = self->parser_.get().result_int(), .problem = {}});
        });
  }
  void fail(const char* doing, error_code error) {
    done_({.status = 0, .problem = std::string(doing) + ": " + error.message()});
  }
  auto& lowest() { return beast::get_lowest_layer(stream_); }

  Url url_;
  const PostTimeouts timeouts_;
  Request request_;
  const HttpPost::Done done_;
  Stream stream_;
  beast::flat_buffer buffer_;
  http::response_parser<http::empty_body> parser_;
};

}  // namespace

struct HttpPost::State {
  // Where the thread of a lookup, which may outlive the HttpPost, gives its result.
  struct Link {
    explicit Link(asio::io_context& context) : io(&context) {}
    std::mutex mutex;
    asio::io_context* io;  // null when the HttpPost is destroyed
  };

  State(asio::io_context& context, Url to, PostTimeouts limits)
      : io(context), link(std::make_shared<Link>(context)), url(std::move(to)), timeouts(limits) {
    if (!url.encrypted) return;
    authorities.emplace(ssl::context::tls_client);
    authorities->set_options(ssl::context::no_tlsv1 | ssl::context::no_tlsv1_1);
    authorities->set_verify_mode(ssl::verify_peer);
    authorities->set_default_verify_paths();
  }

  ~State() {
    const std::lock_guard lock(link->mutex);
    link->io = nullptr;
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  // Throws std::system_error if there is no thread for it: a lookup blocks, and cannot be interrupted.
  void lookUp(std::function<void(error_code, const tcp::resolver::results_type&)> found) {
    error_code isName;
    const asio::ip::address address = asio::ip::make_address(url.host, isName);
    if (!isName) {
      const auto port = static_cast<std::uint16_t>(std::stoul(url.port));
      return asio::post(io, [found = std::move(found), at = tcp::endpoint(address, port), this] {
        found({}, tcp::resolver::results_type::create(at, url.host, url.port));
      });
    }
    std::thread([to = link, host = url.host, port = url.port, found = std::move(found)]() mutable {
      asio::io_context own;
      error_code error;
      const auto endpoints = tcp::resolver(own).resolve(host, port, error);
      const std::lock_guard lock(to->mutex);
      if (to->io == nullptr) return;
      asio::post(*to->io, [found = std::move(found), error, endpoints] { found(error, endpoints); });
    }).detach();
  }

  void exchange(const tcp::resolver::results_type& endpoints, Request request, Done done) {
    if (authorities)
      std::make_shared<Exchange<Encrypted>>(url, timeouts, std::move(request), std::move(done), io,
                                            *authorities)
          ->start(endpoints);
    else
      std::make_shared<Exchange<Plain>>(url, timeouts, std::move(request), std::move(done), io)
          ->start(endpoints);
  }

  asio::io_context& io;
  const std::shared_ptr<Link> link;
  const Url url;
  const PostTimeouts timeouts;
  std::optional<ssl::context> authorities;  // with https
};

HttpPost::HttpPost(asio::io_context& io, Url url, PostTimeouts timeouts)
    : state_(std::make_unique<State>(io, std::move(url), timeouts)) {}

HttpPost::~HttpPost() = default;

void HttpPost::send(const Headers& headers, std::string body, Done done) {
  constexpr unsigned kHttp11 = 11;
  Request request(http::verb::post, state_->url.target, kHttp11);
  request.set(http::field::host, state_->url.authority);
  request.set(http::field::connection, "close");
  for (const auto& [name, value] : headers) request.set(name, value);
  request.body() = std::move(body);
  request.prepare_payload();
  try {
    state_->lookUp([state = state_.get(), request = std::move(request), done](
                       error_code error, const tcp::resolver::results_type& endpoints) {
      if (error) return done({.status = 0, .problem = "looking up the name: " + error.message()});
      state->exchange(endpoints, request, done);
    });
  } catch (const std::system_error& failure) {  // no thread
    asio::post(state_->io,
               [done, problem = std::string(failure.what())] { done({.status = 0, .problem = problem}); });
  }
}

}  // namespace clothstream::events
