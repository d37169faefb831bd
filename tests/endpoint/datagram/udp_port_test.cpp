// SPDX-License-Identifier: MIT
// The UDP port with the sockets of both families, and with those of IPv4 alone.
#include "server/endpoint/datagram/udp_port.h"

#include <array>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>

namespace clothstream::endpoint {
namespace {

using namespace std::chrono_literals;

const std::array<std::uint8_t, 4> kLoopback{127, 0, 0, 1};

// From now on this thread gets no IPv6 sockets, as in a kernel with ipv6.disable=1. Returns whether it
// worked.
bool forbidIpv6Sockets() {
  constexpr std::uint16_t kLoad = BPF_LD | BPF_W | BPF_ABS, kIfEqual = BPF_JMP | BPF_JEQ | BPF_K,
                          kReturn = BPF_RET | BPF_K;
  std::array<sock_filter, 6> filter{{
      {kLoad, 0, 0, offsetof(seccomp_data, nr)},
      {kIfEqual, 0, 3, SYS_socket},
      {kLoad, 0, 0, offsetof(seccomp_data, args)},  // low half of the family
      {kIfEqual, 0, 1, AF_INET6},
      {kReturn, 0, 0, SECCOMP_RET_ERRNO | EAFNOSUPPORT},
      {kReturn, 0, 0, SECCOMP_RET_ALLOW},
  }};
  const sock_fprog program{.len = filter.size(), .filter = filter.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

// A datagram to a port, and its answer. Returns whether the port has IPv6.
bool exchange() {
  boost::asio::io_context io;
  UdpPort server(io, "0.0.0.0", 0), client(io, "127.0.0.1", 0);
  EXPECT_GT(server.queues().receive, 0);
  std::optional<Route> arrived, answered;
  server.receive(
      [&](const Route& route, std::span<const std::byte> datagram) {
        arrived = route;
        server.send(route, datagram);
        server.flush();
      },
      [] {});
  std::vector<std::byte> answer;
  client.receive(
      [&](const Route& route, std::span<const std::byte> datagram) {
        answered = route;
        answer.assign(datagram.begin(), datagram.end());
        io.stop();
      },
      [] {});
  const std::vector<std::byte> sent(100, std::byte{7});
  client.send({.peer = Address::ofIpv4(kLoopback, server.port())}, sent);
  client.flush();
  io.run_for(20s);
  EXPECT_EQ(answer, sent);
  EXPECT_EQ(arrived.value().peer, Address::ofIpv4(kLoopback, client.port()));
  EXPECT_EQ(arrived.value().local, Address::ofIpv4(kLoopback, 0).bytes);
  EXPECT_EQ(answered.value().peer, Address::ofIpv4(kLoopback, server.port()));
  return server.hasIpv6();
}

TEST(UdpPortTest, AnswersFromReachedAddress) {
  exchange();
}

TEST(UdpPortTest, WorksWithoutIpv6Sockets) {
  std::thread([] {
    ASSERT_TRUE(forbidIpv6Sockets());
    EXPECT_FALSE(exchange());
    boost::asio::io_context io;
    EXPECT_FALSE(UdpPort(io, "::", 0).hasIpv6());
    EXPECT_THROW(UdpPort(io, "::1", 0), std::runtime_error);
  }).join();
}

}  // namespace
}  // namespace clothstream::endpoint
