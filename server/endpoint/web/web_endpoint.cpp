// SPDX-License-Identifier: MIT
#include "server/endpoint/web/web_endpoint.h"

#include <chrono>
#include <exception>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include "server/endpoint/listen/listen.h"
#include "server/endpoint/web/endpoint_context.h"
#include "server/endpoint/web/http_connection.h"
#include "server/endpoint/web/web_socket_stream.h"
#include "server/hosting/scene_server.h"
#include "server/telemetry/thread_name.h"
#include "server/tls/qr_code.h"

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;
using net::ip::tcp;
using namespace std::chrono_literals;

// Number of connections beyond the limit that still get an answer with the reason.
constexpr std::size_t kAnsweredBeyondLimit = 64;
// Most unsent bytes in the kernel. Frames that wait there longer are stale when they are sent.
constexpr int kUnsentBytes = 16 * 1024;
constexpr auto kStopTimeout = 1s;
constexpr auto kAcceptPause = 100ms;

ConnectionLimits limitsOf(const WebEndpointOptions& options) {
  ConnectionLimits limits = options.connections;
  limits.connections = options.maxConnections + kAnsweredBeyondLimit;
  return limits;
}

// Adds the files from which the page learns its address for other devices.
void addAddress(Page& page, const WebEndpointOptions& options, std::uint16_t port) {
  nlohmann::json shown{{"address", ""}, {"fingerprint", ""}};
  if (!options.hostInNetwork.empty()) {
    const bool isV6 = options.hostInNetwork.find(':') != std::string::npos;
    const std::string address = fmt::format(fmt::runtime(isV6 ? "{}://[{}]:{}/" : "{}://{}:{}/"),
                                            options.tls ? "https" : "http", options.hostInNetwork, port);
    shown["address"] = address;
    if (options.tls && options.showsFingerprint) shown["fingerprint"] = options.tls->fingerprint();
    page.add("/address.svg", tls::qrImage(address));
  }
  page.add("/address.json", shown.dump());
}

void sendFresh(tcp::socket& socket) {
  boost::system::error_code ignored;  // the first read finds a socket that is already closed
  socket.set_option(tcp::no_delay(true), ignored);
  ::setsockopt(socket.native_handle(), IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kUnsentBytes, sizeof kUnsentBytes);
}

}  // namespace

struct WebEndpoint::State {
  WebEndpointContext context;  // outlives the sockets, which are destroyed with `io`
  Admission admission;
  net::io_context io{1};
  net::executor_work_guard<net::io_context::executor_type> work{io.get_executor()};  // until io.stop()
  tcp::acceptor acceptor;
  net::steady_timer timer{io};
  std::uint16_t port;
  std::thread thread;

  State(hosting::SceneServer& server, const WebEndpointOptions& options)
      : context{.server = server,
                .io = io,
                .page = Page(options.pageDirectory),
                .names = HostNames(options.publicNames),
                .tls = options.tls,
                .allowedOrigins = options.allowedOrigins,
                .maxConnections = options.maxConnections,
                .streams = {}},
        admission(limitsOf(options)),
        acceptor(listen(io, options.host, options.port, "--port")),
        port(acceptor.local_endpoint().port()) {
    if (!context.page.empty()) addAddress(context.page, options, port);
    accept();
    thread = std::thread([this] { run(); });
  }

  ~State() {
    net::post(io, [this] { stop(); });
    thread.join();
    // No wake may reach `io` during its destruction.
    for (const auto& session : context.streams) session->leave();
    context.streams.clear();
  }

  // An exception ends the handler of one socket and not the endpoint.
  void run() {
    telemetry::nameThread("web");
    for (;;) try {
        io.run();
        return;
      } catch (const std::exception& failure) {
        spdlog::error("page: {}", failure.what());
        if (context.stopping) return;
      }
  }

  void accept() {
    acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
      if (context.stopping) return;
      if (error) {  // such as no free descriptor; an immediate retry would only spin
        timer.expires_after(kAcceptPause);
        timer.async_wait([this](boost::system::error_code cancelled) {
          if (!cancelled) accept();
        });
        return;
      }
      accept();  // first, so that it goes on if serve() throws
      serve(std::move(socket));
    });
  }

  void serve(tcp::socket socket) {
    boost::system::error_code error;
    const tcp::endpoint peer = socket.remote_endpoint(error);
    if (error) return;  // the peer has disconnected
    auto ticket = admission.admit(peer.address(), schedule::Clock::now());
    if (!ticket) return context.server.metrics.refuse(ticket.error());
    sendFresh(socket);
    std::make_shared<HttpConnection>(std::move(socket), context, std::move(*ticket))->start();
  }

  void stop() {
    context.stopping = true;
    acceptor.close();
    if (context.streams.empty()) return io.stop();
    timer.expires_after(kStopTimeout);
    timer.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) io.stop();
    });
    const auto open = context.streams;  // a copy, since close() may remove a stream
    for (const auto& session : open)
      session->close({boost::beast::websocket::close_code::going_away, "the server is stopping"});
  }
};

WebEndpoint::WebEndpoint(hosting::SceneServer& server, const WebEndpointOptions& options)
    : state_(std::make_unique<State>(server, options)) {}

WebEndpoint::~WebEndpoint() = default;

std::uint16_t WebEndpoint::port() const {
  return state_->port;
}

}  // namespace clothstream::endpoint
