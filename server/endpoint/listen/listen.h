// SPDX-License-Identifier: MIT
// Opens a listening port.
#pragma once

#include <cstdint>
#include <string>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace clothstream::endpoint {

// `host` is an address or a name of this machine; port 0 picks a free one. Throws std::runtime_error with
// advice if the port is in use (`option` is the command line's option that chooses it) or the host is not an
// address of this machine.
boost::asio::ip::tcp::acceptor listen(boost::asio::io_context& io, const std::string& host,
                                      std::uint16_t port, const char* option);

}  // namespace clothstream::endpoint
