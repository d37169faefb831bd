// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/listen.h"

#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <thread>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <gtest/gtest.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;
using net::ip::tcp;

// Runs a function in a network namespace with a loopback device, whose default is another congestion control.
// Returns whether that was possible.
bool runWithDefault(const std::string& congestionControl, const std::function<void()>& run) {
  bool ran = false;
  std::thread([&] {  // the namespace belongs to the thread
    if (::unshare(CLONE_NEWNET) != 0) return;
    net::io_context io;
    tcp::socket any(io, tcp::v4());
    ifreq loopback{};
    std::snprintf(loopback.ifr_name, sizeof loopback.ifr_name, "lo");
    loopback.ifr_flags = IFF_UP;
    if (::ioctl(any.native_handle(), SIOCSIFFLAGS, &loopback) != 0) return;
    std::ofstream("/proc/sys/net/ipv4/tcp_congestion_control") << congestionControl;
    if (congestionControlOf(tcp::socket(io, tcp::v4()).native_handle()) != congestionControl) return;
    run();
    ran = true;
  })
      .join();
  return ran;
}

TEST(Listen, ConnectionsInheritCongestionControl) {
  if (congestionControlOfPorts() != kCongestionControl)
    GTEST_SKIP() << "this kernel has no " << kCongestionControl;
  const bool ran = runWithDefault("reno", [] {
    net::io_context io;
    tcp::acceptor port = listen(io, "127.0.0.1", 0, "--port");
    tcp::socket client(io);
    client.connect(port.local_endpoint());
    EXPECT_EQ(congestionControlOf(client.native_handle()), "reno");
    EXPECT_EQ(congestionControlOf(port.accept().native_handle()), kCongestionControl);
  });
  if (!ran) GTEST_SKIP() << "network namespaces are not permitted here";
}

TEST(Listen, NamesNoCongestionControlWithoutASocket) {
  EXPECT_EQ(congestionControlOf(-1), "");
}

}  // namespace
}  // namespace clothstream::endpoint
