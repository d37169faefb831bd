// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/udp_port.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>

#include <boost/asio/ip/v6_only.hpp>
#include <fmt/format.h>
#include <netinet/in.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include "proto/dtls/limits.h"

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;
using net::ip::udp;

// Datagrams that are handled before others may use the thread.
constexpr int kDatagramsInARow = 64;
// Bytes of each of the kernel's queues. The kernel may allow less.
constexpr int kQueueBytes = 4 * 1024 * 1024;

using PacketInfo = std::array<char, CMSG_SPACE(sizeof(in6_pktinfo))>;

net::ip::address_v6 asV6(const net::ip::address& address) {
  return address.is_v6() ? address.to_v6() : net::ip::make_address_v6(net::ip::v4_mapped, address.to_v4());
}

Address addressOf(const sockaddr_in6& from) {
  Address address{.bytes = {}, .port = ntohs(from.sin6_port)};
  std::memcpy(address.bytes.data(), &from.sin6_addr, address.bytes.size());
  return address;
}

std::array<std::uint8_t, 16> destinationOf(msghdr& message) {
  std::array<std::uint8_t, 16> destination{};
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part))
    if (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_PKTINFO)
      std::memcpy(destination.data(), CMSG_DATA(part) + offsetof(in6_pktinfo, ipi6_addr), destination.size());
  return destination;
}

}  // namespace

UdpPort::UdpPort(net::io_context& io, const std::string& host, std::uint16_t port) : socket_(io) {
  boost::system::error_code error;
  const auto found = udp::resolver(io).resolve(host, std::to_string(port), udp::resolver::passive, error);
  const auto refuse = [&](const std::string& why) {
    return std::runtime_error(
        fmt::format("cannot open UDP port {} of {} for datagrams: {}", port, host, why));
  };
  if (error) throw refuse(error.message());
  const udp::endpoint endpoint(asV6(found.begin()->endpoint().address()), port);
  socket_.open(udp::v6(), error);
  if (!error) socket_.set_option(net::ip::v6_only(false), error);
  if (!error) socket_.bind(endpoint, error);
  if (!error) socket_.non_blocking(true, error);
  if (error == net::error::address_in_use)
    throw refuse("it is already in use; choose another with --datagram-port");
  if (error) throw refuse(error.message());
  const int on = 1;
  if (::setsockopt(socket_.native_handle(), IPPROTO_IPV6, IPV6_RECVPKTINFO, &on, sizeof on) != 0)
    throw refuse("the kernel does not say to which address datagrams were sent");
  for (const int queue : {SO_RCVBUF, SO_SNDBUF})
    ::setsockopt(socket_.native_handle(), SOL_SOCKET, queue, &kQueueBytes, sizeof kQueueBytes);
}

void UdpPort::receive(std::function<void(const Route&, std::span<const std::byte>)> handle,
                      std::function<void()> done) {
  handle_ = std::move(handle);
  done_ = std::move(done);
  await();
}

void UdpPort::await() {
  socket_.async_wait(udp::socket::wait_read, [this](boost::system::error_code error) {
    if (error) return;  // closed
    receiveSome();
    await();
  });
}

void UdpPort::receiveSome() {
  std::array<std::byte, dtls::kMaxDatagramBytes> datagram;
  for (int i = 0; i < kDatagramsInARow; ++i) {
    sockaddr_in6 from{};
    alignas(cmsghdr) PacketInfo info{};
    iovec bytes{.iov_base = datagram.data(), .iov_len = datagram.size()};
    msghdr message{};
    message.msg_name = &from;
    message.msg_namelen = sizeof from;
    message.msg_iov = &bytes;
    message.msg_iovlen = 1;
    message.msg_control = info.data();
    message.msg_controllen = info.size();
    const ssize_t size = ::recvmsg(socket_.native_handle(), &message, 0);
    if (size < 0) break;  // nothing more
    if ((message.msg_flags & MSG_TRUNC) != 0) continue;
    handle_({.peer = addressOf(from), .local = destinationOf(message)},
            std::span(datagram).first(static_cast<std::size_t>(size)));
  }
  done_();
}

void UdpPort::send(const Route& route, std::span<const std::byte> datagram) {
  sockaddr_in6 to{};
  to.sin6_family = AF_INET6;
  to.sin6_port = htons(route.peer.port);
  std::memcpy(&to.sin6_addr, route.peer.bytes.data(), route.peer.bytes.size());
  iovec bytes{.iov_base = const_cast<std::byte*>(datagram.data()), .iov_len = datagram.size()};
  msghdr message{};
  message.msg_name = &to;
  message.msg_namelen = sizeof to;
  message.msg_iov = &bytes;
  message.msg_iovlen = 1;
  alignas(cmsghdr) PacketInfo info{};
  if (route.local != decltype(route.local){}) {
    message.msg_control = info.data();
    message.msg_controllen = info.size();
    cmsghdr* const part = CMSG_FIRSTHDR(&message);
    part->cmsg_level = IPPROTO_IPV6;
    part->cmsg_type = IPV6_PKTINFO;
    part->cmsg_len = CMSG_LEN(sizeof(in6_pktinfo));
    std::memcpy(CMSG_DATA(part) + offsetof(in6_pktinfo, ipi6_addr), route.local.data(), route.local.size());
  }
  static_cast<void>(::sendmsg(socket_.native_handle(), &message, 0));
}

}  // namespace clothstream::endpoint
