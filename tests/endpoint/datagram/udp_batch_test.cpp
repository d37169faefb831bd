// SPDX-License-Identifier: MIT
// Datagrams leave whole and in order, however the port joins them for the kernel.
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <gtest/gtest.h>

#include "server/endpoint/datagram/udp_port.h"

namespace clothstream::endpoint {
namespace {

using Bytes = std::vector<std::byte>;

class UdpBatchTest : public ::testing::Test {
 protected:
  UdpBatchTest() {
    port.receive([this](const Route&,
                        std::span<const std::byte> bytes) { got.emplace_back(bytes.begin(), bytes.end()); },
                 [] {});
  }

  static Route to(const UdpPort& receiver) {
    return {.peer = Address::ofIpv4({127, 0, 0, 1}, receiver.port())};
  }
  // A datagram of this length, which differs from others by its number.
  static Bytes datagram(std::size_t bytes, std::uint8_t number) { return Bytes(bytes, std::byte{number}); }

  // Sends them to `port` in one batch, and checks that they arrive.
  void expectArrival(const std::vector<Bytes>& sent) {
    for (const Bytes& each : sent) sender.send(to(port), each);
    sender.flush();
    while (got.size() < sent.size() && io.run_one_for(std::chrono::seconds(5)) > 0) {
    }
    EXPECT_EQ(got, sent);
    got.clear();
  }

  boost::asio::io_context io;
  UdpPort port{io, "127.0.0.1", 0}, sender{io, "127.0.0.1", 0};
  std::vector<Bytes> got;
};

TEST_F(UdpBatchTest, EqualDatagramsStayApart) {
  std::vector<Bytes> sent;
  for (std::uint8_t i = 0; i < 200; ++i) sent.push_back(datagram(1200, i));
  expectArrival({sent.begin(), sent.begin() + 2});
  expectArrival(sent);
}

TEST_F(UdpBatchTest, LengthsMayDiffer) {
  expectArrival({datagram(1200, 1), datagram(1200, 2), datagram(7, 3), datagram(7, 4), datagram(1200, 5),
                 datagram(1, 6), datagram(1, 7)});
}

TEST_F(UdpBatchTest, PeersGetTheirOwn) {
  UdpPort other{io, "127.0.0.1", 0};
  std::vector<Bytes> others;
  other.receive([&](const Route&,
                    std::span<const std::byte> bytes) { others.emplace_back(bytes.begin(), bytes.end()); },
                [] {});
  sender.send(to(other), datagram(100, 1));
  expectArrival({datagram(100, 2), datagram(100, 3)});
  while (others.empty() && io.run_one_for(std::chrono::seconds(5)) > 0) {
  }
  EXPECT_EQ(others, std::vector<Bytes>{datagram(100, 1)});
}

TEST_F(UdpBatchTest, EmptyFlushSendsNothing) {
  sender.flush();
  expectArrival({datagram(3, 1)});
}

}  // namespace
}  // namespace clothstream::endpoint
