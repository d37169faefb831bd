// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/listen.h"

#include <stdexcept>

#include <boost/asio/ip/v6_only.hpp>
#include <fmt/format.h>

namespace clothstream::endpoint {

namespace net = boost::asio;
using net::ip::tcp;

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
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(net::socket_base::max_listen_connections, error);
  if (error == net::error::address_in_use)
    throw refuse(fmt::format("port {} on {} is already in use: choose another with {}", port, host, option));
  if (error) throw refuse(fmt::format("cannot listen on port {} of {}: {}", port, host, error.message()));
  return acceptor;
}

}  // namespace clothstream::endpoint
