// SPDX-License-Identifier: MIT
// UDP port that answers from the address at which it was reached.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>

#include "server/endpoint/datagram/association_table.h"

namespace clothstream::endpoint {

// Peers check that answers come from the address that they have sent to (RFC 8445, section 7.2.5.2.1), but a
// machine may have several. So each datagram is received with its destination, and sent with a source
// (IPV6_PKTINFO, RFC 3542, section 6; IP_PKTINFO of ip(7)). The socket has both families, or IPv4 alone if
// the kernel has no IPv6 sockets. Belongs to the io thread.
//
// Datagrams in a row for one peer leave in one call of the kernel, because a call costs more than a datagram:
// the pieces of a frame have equal lengths.
class UdpPort {
 public:
  // Bytes of each of the kernel's two queues that the port asks for.
  static constexpr int kQueueBytes = 4 * 1024 * 1024;

  // `host` is an address or a name of this machine; port 0 picks a free one. Throws std::runtime_error that
  // says what to do if the port is in use, or the host is not an address of this machine.
  UdpPort(boost::asio::io_context& io, const std::string& host, std::uint16_t port);

  std::uint16_t port() const { return socket_.local_endpoint().port(); }
  bool hasIpv6() const { return hasIpv6_; }
  struct Queues {
    int receive, send;
  };
  // Bytes that the kernel allows for each queue.
  Queues queues() const;

  // Calls `handle` with each datagram from now on, several in a row, and `done` after these. Longer datagrams
  // than dtls::kMaxDatagramBytes are dropped. Call it once.
  void receive(std::function<void(const Route& route, std::span<const std::byte> datagram)> handle,
               std::function<void()> done);
  // Takes a datagram. flush() must follow.
  void send(const Route& route, std::span<const std::byte> datagram);
  // Sends what was taken, or loses it if the kernel has no room.
  void flush();
  void close() { socket_.close(); }

 private:
  // Datagrams with one route, and with one length but for the last one, which may be shorter.
  struct Batch {
    Route route;
    std::vector<std::byte> bytes;  // one datagram after the other
    std::size_t datagramBytes = 0;
  };

  void await();
  void receiveSome();
  // Whether a datagram of this length can leave with the batch.
  bool joins(const Route& route, std::size_t bytes) const;
  // Sends whole datagrams of the batch. Returns false if the kernel cannot cut them for this route.
  bool transmit(std::span<const std::byte> bytes);

  boost::asio::ip::udp::socket socket_;
  bool hasIpv6_ = true;
  bool joins_ = true;  // the kernel has UDP_SEGMENT (Linux 4.18)
  Batch batch_;
  std::function<void(const Route& route, std::span<const std::byte> datagram)> handle_;
  std::function<void()> done_;
};

}  // namespace clothstream::endpoint
