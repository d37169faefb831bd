// SPDX-License-Identifier: MIT
#include "server/endpoint/grpc/acceptor.h"

#include <chrono>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "server/endpoint/listen/listen.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;
using net::ip::tcp;
using namespace std::chrono_literals;

constexpr auto kAcceptPause = 100ms;
constexpr auto kCheckInterval = 250ms;

}  // namespace

Acceptor::Acceptor(const std::string& host, std::uint16_t port, const ConnectionLimits& limits,
                   std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> to,
                   telemetry::ServerMetrics& metrics)
    : acceptor_(listen(io_, host, port, "--grpc-port")),
      address_(acceptor_.local_endpoint()),
      maxConnections_(limits.connections),
      admission_(limits),
      to_(std::move(to)),
      metrics_(metrics) {}

Acceptor::~Acceptor() {
  io_.stop();
  if (thread_.joinable()) thread_.join();
  for (const Connection& connection : connections_) ::close(connection.copy);
}

void Acceptor::start() {
  accept();
  checkLater();
  thread_ = std::thread([this] {
    telemetry::nameThread("grpc acceptor");
    io_.run();
  });
}

void Acceptor::accept() {
  acceptor_.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (!error) {
      accepted(std::move(socket));
      return accept();
    }
    // For example, no descriptor is free. An immediate retry would only spin.
    pause_.expires_after(kAcceptPause);
    pause_.async_wait([this](boost::system::error_code cancelled) {
      if (!cancelled) accept();
    });
  });
}

void Acceptor::accepted(tcp::socket socket) {
  boost::system::error_code error;
  const tcp::endpoint peer = socket.remote_endpoint(error);
  if (error) return;  // the peer has disconnected
  if (connections_.size() >= maxConnections_) forgetEnded();
  auto ticket = admission_.admit(peer.address(), schedule::Clock::now());
  if (!ticket) return metrics_.refuse(ticket.error());
  socket.set_option(tcp::no_delay(true), error);
  socket.non_blocking(true, error);
  connections_.push_back({-1, std::move(*ticket)});
  connections_.back().copy = ::fcntl(socket.native_handle(), F_DUPFD_CLOEXEC, 0);
  if (connections_.back().copy < 0) {
    connections_.pop_back();
    return metrics_.refuse(telemetry::Refusal::connections);
  }
  grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
  connection.fd = socket.release(error);
  if (error) {
    ::close(connections_.back().copy);
    return connections_.pop_back();
  }
  to_->HandleNewConnection(&connection);
}

void Acceptor::checkLater() {
  check_.expires_after(kCheckInterval);
  check_.async_wait([this](boost::system::error_code cancelled) {
    if (cancelled) return;
    forgetEnded();
    checkLater();
  });
}

void Acceptor::forgetEnded() {
  // gRPC shuts both directions of a connection down before it closes its descriptor.
  std::vector<pollfd> files;
  files.reserve(connections_.size());
  for (const Connection& connection : connections_) files.push_back({connection.copy, 0, 0});
  if (::poll(files.data(), files.size(), 0) <= 0) return;
  auto file = files.begin();
  std::erase_if(connections_, [&](const Connection& connection) {
    const bool ended = (file++)->revents != 0;  // an error or the end
    if (ended) ::close(connection.copy);
    return ended;
  });
}

}  // namespace clothstream::endpoint
