// SPDX-License-Identifier: MIT
#include "server/endpoint/listen/admission.h"

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/endpoint/listen/address_rate.h"

namespace clothstream::endpoint {
namespace {

using telemetry::Refusal;

const schedule::Clock::time_point kNow{std::chrono::hours(1)};

boost::asio::ip::address address(const char* text) {
  return boost::asio::ip::make_address(text);
}

TEST(AdmissionTest, LimitsConnectionsInAllAndCountsEndedOnesNoMore) {
  Admission admission({.connections = 2});
  auto first = admission.admit(address("127.0.0.1"), kNow);
  ASSERT_TRUE(first);
  {
    const auto second = admission.admit(address("192.0.2.1"), kNow);
    ASSERT_TRUE(second);
    EXPECT_EQ(admission.admit(address("192.0.2.2"), kNow).error(), Refusal::connections);
    EXPECT_EQ(admission.connections(), 2U);
  }
  EXPECT_EQ(admission.connections(), 1U);
  EXPECT_TRUE(admission.admit(address("192.0.2.2"), kNow));
}

TEST(AdmissionTest, LimitsConnectionsOfAnAddressButNotOfThisMachine) {
  Admission admission({.connections = 100, .connectionsPerAddress = 2});
  std::vector<Admission::Ticket> open;
  const auto admit = [&](const char* from) {
    auto ticket = admission.admit(address(from), kNow);
    if (ticket) open.push_back(std::move(*ticket));
    return ticket.has_value();
  };
  EXPECT_TRUE(admit("192.0.2.1") && admit("192.0.2.1"));
  EXPECT_EQ(admission.admit(address("192.0.2.1"), kNow).error(), Refusal::connectionsOfAddress);
  EXPECT_FALSE(admit("::ffff:192.0.2.1")) << "the same address, mapped to IPv6";
  EXPECT_TRUE(admit("192.0.2.2"));
  EXPECT_TRUE(admit("2001:db8::1") && admit("2001:db8::2"));
  EXPECT_FALSE(admit("2001:db8::3")) << "the same first 64 bits";
  EXPECT_TRUE(admit("2001:db8:0:1::3"));
  EXPECT_TRUE(admit("fe80::1%2") && admit("fe80::1%2"));
  EXPECT_FALSE(admit("fe80::1%2"));
  EXPECT_TRUE(admit("fe80::2%2")) << "another machine of the network";
  EXPECT_TRUE(admit("fe80::1%3")) << "another network";
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(admit(i % 2 == 0 ? "127.0.0.1" : "::1"));
  open.clear();
  EXPECT_TRUE(admit("192.0.2.1"));
}

TEST(AdmissionTest, LimitsNewConnectionsPerSecond) {
  Admission admission({.connectionsPerSecond = 10});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(admission.admit(address("127.0.0.1"), kNow)) << i;
  EXPECT_EQ(admission.admit(address("127.0.0.1"), kNow).error(), Refusal::connectionRate);
  EXPECT_TRUE(admission.admit(address("127.0.0.1"), kNow + std::chrono::milliseconds(150)));
  EXPECT_FALSE(admission.admit(address("127.0.0.1"), kNow + std::chrono::milliseconds(150)));
}

TEST(AdmissionTest, OneAddressDoesNotTakeTheConnectionsPerSecondOfOthers) {
  Admission admission({.connectionsPerSecond = 10, .connectionsPerSecondOfAddress = 4});
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(admission.admit(address("192.0.2.1"), kNow)) << i;
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(admission.admit(address("192.0.2.1"), kNow).error(), Refusal::connectionRateOfAddress);
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(admission.admit(address("192.0.2.2"), kNow)) << i;
  EXPECT_TRUE(admission.admit(address("192.0.2.1"), kNow + std::chrono::milliseconds(300)));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(admission.admit(address("::1"), kNow)) << i;
}

TEST(AdmissionTest, TicketMayOutliveTheAdmission) {
  auto admission = std::make_unique<Admission>(ConnectionLimits{});
  auto ticket = admission->admit(address("192.0.2.1"), kNow);
  admission.reset();
  EXPECT_TRUE(ticket);
}

// An attacker with many addresses must not reset the limits of those who are busy.
TEST(AddressRateTest, ManyAddressesDoNotResetABusyOne) {
  AddressRate rate(10, 10);
  ASSERT_TRUE(rate.take("busy", kNow, 10));
  for (int i = 0; i < 8'000; ++i)
    ASSERT_TRUE(rate.take(std::to_string(i), kNow + i * std::chrono::microseconds(100)));
  EXPECT_FALSE(rate.take("busy", kNow + std::chrono::milliseconds(800), 9));
}

}  // namespace
}  // namespace clothstream::endpoint
