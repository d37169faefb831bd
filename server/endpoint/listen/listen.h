// SPDX-License-Identifier: MIT
// Opens a listening port.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace clothstream::endpoint {

// Congestion control of connections, if the kernel has it. Where packets are lost, BBR sends more frames, and
// sends them earlier, than Debian's default CUBIC, which slows down after each loss.
inline constexpr std::string_view kCongestionControl = "bbr";

// `host` is an address or a name of this machine; port 0 picks a free one. Throws std::runtime_error with
// advice if the port is in use (`option` is the command line's option that chooses it) or the host is not an
// address of this machine.
//
// Connections inherit kCongestionControl from the port. If the kernel does not have it, they keep the
// kernel's default. A route that names a congestion control (`ip route ... congctl`) wins.
boost::asio::ip::tcp::acceptor listen(boost::asio::io_context& io, const std::string& host,
                                      std::uint16_t port, const char* option);

// Congestion control of a TCP socket, such as "cubic"; empty if the kernel does not say.
std::string congestionControlOf(int socket);
// Congestion control that the connections of a port get; empty if the kernel does not say.
std::string congestionControlOfPorts();

}  // namespace clothstream::endpoint
