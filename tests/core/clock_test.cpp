// SPDX-License-Identifier: MIT
// Pings and what their pongs say of round trip and clock.
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

constexpr std::uint64_t kMs = 1000;

std::vector<std::uint64_t> pings(ClientUnderTest& client) {
  std::vector<std::uint64_t> times;
  for (const v1::ClientMessage& message : client.outgoing()) {
    if (message.has_ping()) times.push_back(message.ping().client_time_us());
  }
  return times;
}

TEST(Clock, PingsSoonOnceWelcomedAndThenTwiceASecond) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  std::size_t firstSecond = 0, laterSecond = 0;
  for (std::uint64_t now = 5 * kMs; now < 12'000 * kMs; now += 50 * kMs) {
    cs_update(client.get(), now);
    const std::size_t count = pings(client).size();
    if (now < 1000 * kMs) firstSecond += count;
    if (now > 11'000 * kMs) laterSecond += count;
  }
  EXPECT_EQ(firstSecond, 10u);
  EXPECT_EQ(laterSecond, 2u);
}

TEST(Clock, FindsTheOffsetThroughJitterToHalfTheSmallestQueue) {
  // 10 ms each way, and queues of up to 20 ms on each. The shortest of 16 round trips bounds the error: a
  // clock's error is half the difference of the two queues, which for exponential queues of mean 3 ms is
  // small in the best.
  std::mt19937 random(7);
  std::exponential_distribution<double> queueMs(1 / 3.0);
  constexpr double kOffsetUs = 123'456'789;
  ClientUnderTest client;
  client.join(ScriptedServer());
  for (std::uint64_t now = 1000 * kMs; now < 4000 * kMs; now += 100 * kMs) {
    cs_update(client.get(), now);
    for (const std::uint64_t sent : pings(client)) {
      const auto up = static_cast<std::uint64_t>((10 + queueMs(random)) * 1000);
      const auto down = static_cast<std::uint64_t>((10 + queueMs(random)) * 1000);
      client.receive(ScriptedServer::pong(sent, sent + up + static_cast<std::uint64_t>(kOffsetUs)),
                     sent + up + down);
    }
  }
  const cs_statistics statistics = client.statistics();
  EXPECT_GE(statistics.round_trip_ms, 20);
  EXPECT_LT(statistics.round_trip_ms, 22);
  // Whatever the queues were, the error is at most half of what the round trip has beyond the 20 ms.
  EXPECT_NEAR(statistics.clock_offset_us, kOffsetUs, (statistics.round_trip_ms - 20) * 1000 / 2 + 1);
}

TEST(Clock, AServerWhoseClockIsBehindHasANegativeOffset) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  cs_update(client.get(), 5000 * kMs);
  client.receive(ScriptedServer::pong(5000 * kMs, 2000 * kMs + 4 * kMs), 5008 * kMs);
  EXPECT_DOUBLE_EQ(client.statistics().round_trip_ms, 8);
  EXPECT_DOUBLE_EQ(client.statistics().clock_offset_us, -3'000'000);
}

TEST(Clock, PongsThatAnswerNothingAreLeftAside) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  cs_update(client.get(), 1000 * kMs);
  client.receive(ScriptedServer::pong(999 * kMs, 1), 1001 * kMs);
  client.receive(ScriptedServer::pong(0, 1), 1001 * kMs);
  EXPECT_EQ(client.statistics().round_trip_ms, 0);
  client.receive(ScriptedServer::pong(1000 * kMs, 1), 1005 * kMs);
  client.receive(ScriptedServer::pong(1000 * kMs, 1), 1001 * kMs);  // a second answer to the same ping
  EXPECT_DOUBLE_EQ(client.statistics().round_trip_ms, 5);
}

}  // namespace
}  // namespace clothstream::client
