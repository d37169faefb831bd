// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/listen.h"

#include <array>
#include <cstring>
#include <stdexcept>

#include <boost/asio/ip/v6_only.hpp>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

namespace clothstream::endpoint {

namespace net = boost::asio;
using net::ip::tcp;

namespace {

// A kernel that refuses keeps its default.
void chooseCongestionControl(int socket) {
  ::setsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, kCongestionControl.data(), kCongestionControl.size());
}

}  // namespace

tcp::acceptor listen(net::io_context& io, const std::string& host, std::uint16_t port, const char* option) {
  boost::system::error_code error;
  const auto refuse = [&](const std::string& what) -> std::runtime_error { return std::runtime_error(what); };
  const auto found = tcp::resolver(io).resolve(host, std::to_string(port), tcp::resolver::passive, error);
  if (error) throw refuse(fmt::format("cannot listen on host '{}': {}", host, error.message()));
  const tcp::endpoint endpoint = *found.begin();
  tcp::acceptor acceptor(io);
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error && endpoint.address().is_v6()) acceptor.set_option(net::ip::v6_only(false), error);
  if (!error) chooseCongestionControl(acceptor.native_handle());
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error == net::error::address_in_use)
    throw refuse(fmt::format("port {} on {} is already in use: choose another with {}", port, host, option));
  if (error) throw refuse(fmt::format("cannot listen on port {} of {}: {}", port, host, error.message()));
  return acceptor;
}

std::string congestionControlOf(int socket) {
  std::array<char, 16> name{};  // TCP_CA_NAME_MAX of Linux
  socklen_t bytes = name.size();
  if (::getsockopt(socket, IPPROTO_TCP, TCP_CONGESTION, name.data(), &bytes) != 0) return {};
  return {name.data(), ::strnlen(name.data(), bytes)};
}

std::string congestionControlOfPorts() {
  net::io_context io;
  tcp::socket socket(io);
  boost::system::error_code failed;
  if (socket.open(tcp::v4(), failed); failed) return {};
  chooseCongestionControl(socket.native_handle());
  return congestionControlOf(socket.native_handle());
}

}  // namespace clothstream::endpoint
