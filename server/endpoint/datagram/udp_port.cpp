// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/udp_port.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <utility>

#include <boost/asio/ip/v6_only.hpp>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/udp.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>

#include "proto/dtls/limits.h"

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;
using net::ip::udp;

// Datagrams that are handled before others may use the thread.
constexpr int kDatagramsInARow = 64;
// Offset of the IPv4 address in a mapped one.
constexpr std::ptrdiff_t kIpv4Offset = 12;
// Room for either family: the structure of IPv6 is the longer one.
using PacketInfo = std::array<char, CMSG_SPACE(sizeof(in6_pktinfo))>;

// Datagrams of one call, and their bytes (UDP_MAX_SEGMENTS of Linux; a UDP packet of IPv4).
constexpr std::size_t kMaxBatch = 64, kMaxBatchBytes = 65'507;

// Control data of a message that is sent, up to a source and the length of its datagrams. Must outlive its
// use.
class SendControl {
 public:
  explicit SendControl(msghdr& message) : message_(message) { message.msg_control = bytes_.data(); }
  SendControl(const SendControl&) = delete;
  SendControl& operator=(const SendControl&) = delete;

  template <typename Value>
  void add(int level, int type, const Value& value) {
    auto* const part = reinterpret_cast<cmsghdr*>(bytes_.data() + message_.msg_controllen);
    part->cmsg_level = level;
    part->cmsg_type = type;
    part->cmsg_len = CMSG_LEN(sizeof value);
    std::memcpy(CMSG_DATA(part), &value, sizeof value);
    message_.msg_controllen += CMSG_SPACE(sizeof value);
  }

 private:
  msghdr& message_;
  alignas(
      cmsghdr) std::array<char, CMSG_SPACE(sizeof(in6_pktinfo)) + CMSG_SPACE(sizeof(std::uint16_t))> bytes_{};
};

// Whether the kernel has IPv6 sockets (not after ipv6.disable=1). The socket is then open.
bool openIpv6(udp::socket& socket, boost::system::error_code& error) {
  socket.open(udp::v6(), error);
  return error != net::error::address_family_not_supported;
}

// The same address for a socket of both families, or of IPv4 alone.
net::ip::address ofFamily(const net::ip::address& address, bool ipv6, boost::system::error_code& error) {
  if (ipv6) return address.is_v6() ? address : net::ip::make_address_v6(net::ip::v4_mapped, address.to_v4());
  if (address.is_v6() && address.is_unspecified()) return net::ip::address_v4::any();
  if (address.is_v6()) error = net::error::address_family_not_supported;
  return address;
}

Address addressOf(const sockaddr_storage& from) {
  Address address;
  if (from.ss_family == AF_INET) {
    sockaddr_in ipv4;
    std::memcpy(&ipv4, &from, sizeof ipv4);
    return Address::ofIpv4(std::bit_cast<std::array<std::uint8_t, 4>>(ipv4.sin_addr), ntohs(ipv4.sin_port));
  }
  sockaddr_in6 ipv6;
  std::memcpy(&ipv6, &from, sizeof ipv6);
  std::memcpy(address.bytes.data(), &ipv6.sin6_addr, address.bytes.size());
  address.port = ntohs(ipv6.sin6_port);
  return address;
}

// Returns the length of the address that is written to `to`.
socklen_t write(const Address& address, bool ipv6, sockaddr_storage& to) {
  if (ipv6) {
    sockaddr_in6 written{};
    written.sin6_family = AF_INET6;
    written.sin6_port = htons(address.port);
    std::memcpy(&written.sin6_addr, address.bytes.data(), address.bytes.size());
    std::memcpy(&to, &written, sizeof written);
    return sizeof written;
  }
  sockaddr_in written{};
  written.sin_family = AF_INET;
  written.sin_port = htons(address.port);
  std::memcpy(&written.sin_addr, address.bytes.data() + kIpv4Offset, sizeof written.sin_addr);
  std::memcpy(&to, &written, sizeof written);
  return sizeof written;
}

std::array<std::uint8_t, 16> destinationOf(msghdr& message) {
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level == IPPROTO_IPV6 && part->cmsg_type == IPV6_PKTINFO) {
      std::array<std::uint8_t, 16> destination;
      std::memcpy(destination.data(), CMSG_DATA(part) + offsetof(in6_pktinfo, ipi6_addr), destination.size());
      return destination;
    }
    if (part->cmsg_level == IPPROTO_IP && part->cmsg_type == IP_PKTINFO) {
      std::array<std::uint8_t, 4> destination;
      std::memcpy(destination.data(), CMSG_DATA(part) + offsetof(in_pktinfo, ipi_addr), destination.size());
      return Address::ofIpv4(destination, 0).bytes;
    }
  }
  return {};
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
  hasIpv6_ = openIpv6(socket_, error);
  if (!hasIpv6_) socket_.open(udp::v4(), error);
  if (!error && hasIpv6_) socket_.set_option(net::ip::v6_only(false), error);
  const auto isIpv4 = [](const auto& entry) { return entry.endpoint().address().is_v4(); };
  auto chosen = hasIpv6_ ? found.begin() : std::find_if(found.begin(), found.end(), isIpv4);
  if (chosen == found.end()) chosen = found.begin();
  const net::ip::address address = ofFamily(chosen->endpoint().address(), hasIpv6_, error);
  if (!error) socket_.bind({address, port}, error);
  if (!error) socket_.non_blocking(true, error);
  if (error == net::error::address_in_use)
    throw refuse("it is already in use; choose another with --datagram-port");
  if (error == net::error::access_denied)
    throw refuse(
        "ports below 1024 need the capability CAP_NET_BIND_SERVICE; choose another with --datagram-port");
  if (error) throw refuse(error.message());
  const int on = 1;
  if ((hasIpv6_ ? ::setsockopt(socket_.native_handle(), IPPROTO_IPV6, IPV6_RECVPKTINFO, &on, sizeof on)
                : ::setsockopt(socket_.native_handle(), IPPROTO_IP, IP_PKTINFO, &on, sizeof on)) != 0)
    throw refuse("the kernel does not say to which address datagrams were sent");
  const int whole = 0;
  joins_ = ::setsockopt(socket_.native_handle(), IPPROTO_UDP, UDP_SEGMENT, &whole, sizeof whole) == 0;
  for (const int queue : {SO_RCVBUF, SO_SNDBUF})
    ::setsockopt(socket_.native_handle(), SOL_SOCKET, queue, &kQueueBytes, sizeof kQueueBytes);
}

UdpPort::Queues UdpPort::queues() const {
  boost::system::error_code error;  // leaves 0
  net::socket_base::receive_buffer_size receive;
  net::socket_base::send_buffer_size send;
  socket_.get_option(receive, error);
  socket_.get_option(send, error);
  return {.receive = receive.value(), .send = send.value()};
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
    sockaddr_storage from{};
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
  if (!joins(route, datagram.size())) {
    flush();
    batch_.route = route;
    batch_.datagramBytes = datagram.size();
  }
  batch_.bytes.insert(batch_.bytes.end(), datagram.begin(), datagram.end());
}

bool UdpPort::joins(const Route& route, std::size_t bytes) const {
  const std::size_t waiting = batch_.bytes.size(), each = batch_.datagramBytes;
  return joins_ && waiting > 0 && route == batch_.route && bytes <= each && waiting % each == 0 &&
         waiting / each < kMaxBatch && waiting + bytes <= kMaxBatchBytes;
}

void UdpPort::flush() {
  std::span<const std::byte> rest = batch_.bytes;
  if (!rest.empty() && !transmit(rest)) {
    while (!rest.empty()) {
      const std::size_t bytes = std::min(batch_.datagramBytes, rest.size());
      transmit(rest.first(bytes));
      rest = rest.subspan(bytes);
    }
  }
  batch_.bytes.clear();
}

bool UdpPort::transmit(std::span<const std::byte> bytes) {
  const Route& route = batch_.route;
  sockaddr_storage to{};
  iovec content{.iov_base = const_cast<std::byte*>(bytes.data()), .iov_len = bytes.size()};
  msghdr message{};
  message.msg_name = &to;
  message.msg_namelen = write(route.peer, hasIpv6_, to);
  message.msg_iov = &content;
  message.msg_iovlen = 1;
  SendControl control(message);
  if (route.local != decltype(route.local){}) {
    if (hasIpv6_) {
      in6_pktinfo source{};
      std::memcpy(&source.ipi6_addr, route.local.data(), route.local.size());
      control.add(IPPROTO_IPV6, IPV6_PKTINFO, source);
    } else {
      in_pktinfo source{};
      std::memcpy(&source.ipi_spec_dst, route.local.data() + kIpv4Offset, sizeof source.ipi_spec_dst);
      control.add(IPPROTO_IP, IP_PKTINFO, source);
    }
  }
  const bool several = bytes.size() > batch_.datagramBytes;
  if (several) control.add(IPPROTO_UDP, UDP_SEGMENT, static_cast<std::uint16_t>(batch_.datagramBytes));
  // The kernel refuses where the device makes no checksums (EIO), and datagrams that IP must fragment.
  if (::sendmsg(socket_.native_handle(), &message, 0) >= 0 || !several) return true;
  joins_ = joins_ && errno != EIO;
  return errno != EIO && errno != EINVAL && errno != EMSGSIZE;
}

}  // namespace clothstream::endpoint
