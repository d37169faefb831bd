// SPDX-License-Identifier: MIT
#include "tests/link/direction.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace clothstream::link {
namespace {

using namespace std::chrono_literals;

constexpr Clock::time_point kStart{1h};

// Sends packets of this size, one per interval, and returns the time between entering and leaving of each, in
// seconds; nothing for packets that do not leave. The first four bytes of a packet are its number.
std::vector<std::optional<double>> send(Direction& direction, std::uint32_t packets, Clock::duration interval,
                                        std::size_t size = 100) {
  for (std::uint32_t i = 0; i < packets; ++i) {
    std::vector<std::byte> bytes(size);
    for (int k = 0; k < 4; ++k) bytes[static_cast<std::size_t>(k)] = static_cast<std::byte>(i >> (8 * k));
    direction.enter(bytes, kStart + i * interval);
  }
  std::vector<std::optional<double>> times(packets);
  while (const auto due = direction.next()) {
    const std::vector<std::byte> bytes = direction.leave();
    std::uint32_t number = 0;
    for (int k = 0; k < 4; ++k)
      number |= std::to_integer<std::uint32_t>(bytes[static_cast<std::size_t>(k)]) << (8 * k);
    times.at(number) = std::chrono::duration<double>(*due - (kStart + number * interval)).count();
  }
  return times;
}

std::vector<bool> losses(const Conditions& conditions, std::uint64_t number, Clock::duration interval) {
  constexpr std::uint32_t kPackets = 20'000;
  Direction direction(conditions, number);
  std::vector<bool> lost;
  for (const auto& time : send(direction, kPackets, interval)) lost.push_back(!time);
  EXPECT_EQ(direction.statistics().packets, kPackets);
  EXPECT_EQ(direction.statistics().lost, std::count(lost.begin(), lost.end(), true));
  return lost;
}

double share(const std::vector<bool>& lost) {
  return static_cast<double>(std::count(lost.begin(), lost.end(), true)) / static_cast<double>(lost.size());
}

// Mean number of packets that are lost one after the other.
double meanBurst(const std::vector<bool>& lost) {
  std::uint32_t bursts = 0;
  for (std::size_t i = 0; i < lost.size(); ++i) bursts += lost[i] && (i == 0 || !lost[i - 1]);
  return static_cast<double>(std::count(lost.begin(), lost.end(), true)) / bursts;
}

TEST(Direction, LosesItsShareOfPackets) {
  for (const double loss : {0.01, 0.02, 0.1, 0.5}) {
    const std::vector<bool> lost = losses({.loss = loss}, 0, 1ms);
    // Four standard deviations of the binomial distribution.
    EXPECT_NEAR(share(lost), loss, 4 * std::sqrt(loss * (1 - loss) / 20'000));
    EXPECT_NEAR(meanBurst(lost), 1 / (1 - loss), 0.1);
  }
}

TEST(Direction, LosesBurstsOfPackets) {
  const std::vector<bool> lost = losses({.loss = 0.05, .burstPackets = 4}, 0, 1ms);
  // About 250 bursts, whose lengths are spread as much as their mean.
  EXPECT_NEAR(share(lost), 0.05, 4 * 0.05 * std::sqrt(2.0 / 250));
  EXPECT_NEAR(meanBurst(lost), 4, 4 * 4 / std::sqrt(250.0));
}

TEST(Direction, LosesBurstsOfTime) {
  const Conditions conditions{.loss = 0.1, .burstTime = 20ms};
  for (const Clock::duration interval : {Clock::duration(1ms), Clock::duration(5ms)}) {
    const std::vector<bool> lost = losses(conditions, 0, interval);
    const double bursts = 20'000 * 0.1 * std::chrono::duration<double>(interval) / 20ms;
    EXPECT_NEAR(share(lost), 0.1, 4 * 0.1 * std::sqrt(2 / bursts));
  }
  EXPECT_NEAR(meanBurst(losses(conditions, 0, 1ms)), 20, 8);
}

TEST(Direction, RepeatsLossesOfItsSeed) {
  for (const Conditions& conditions : {Conditions{.loss = 0.1}, Conditions{.loss = 0.1, .burstPackets = 3}}) {
    const std::vector<bool> lost = losses(conditions, 0, 1ms);
    EXPECT_EQ(losses(conditions, 0, 7us), lost);
    EXPECT_NE(losses(conditions, 1, 1ms), lost);
    Conditions limited = conditions;
    limited.delay = 30ms, limited.jitter = 9ms, limited.bytesPerSecond = 1e9, limited.queueBytes = 1e9;
    EXPECT_EQ(losses(limited, 0, 1ms), lost);
    Conditions other = conditions;
    other.seed = 2;
    EXPECT_NE(losses(other, 0, 1ms), lost);
  }
  const Conditions inTime{.loss = 0.1, .burstTime = 4ms};
  EXPECT_EQ(losses(inTime, 0, 1ms), losses(inTime, 0, 1ms));
}

TEST(Direction, DelaysWithJitter) {
  Direction direction({.delay = 25ms, .jitter = 5ms}, 0);
  std::vector<double> delays;
  for (const auto& time : send(direction, 5000, 20ms)) delays.push_back(time.value());
  std::sort(delays.begin(), delays.end());
  EXPECT_GE(delays.front(), 0.025);
  EXPECT_LE(delays.back(), 0.030);
  EXPECT_NEAR(delays[2500], 0.0275, 0.0003);
  EXPECT_EQ(direction.statistics().reordered, 0u);
}

TEST(Direction, KeepsOrderUnlessItReorders) {
  for (const bool reorders : {false, true}) {
    Direction direction({.jitter = 20ms, .reorders = reorders}, 0);
    send(direction, 1000, 1ms);
    EXPECT_EQ(direction.statistics().reordered > 300, reorders);
    if (!reorders) {
      EXPECT_EQ(direction.statistics().reordered, 0u);
    }
  }
}

TEST(Direction, SendsAtItsRate) {
  // A packet takes 1 ms, and ten fit into the queue.
  Direction direction({.bytesPerSecond = 100'000, .queueBytes = 1000}, 0);
  const auto times = send(direction, 20, 0ms);
  for (std::size_t i = 0; i < times.size(); ++i) {
    ASSERT_EQ(times[i].has_value(), i < 10) << i;
    EXPECT_NEAR(times[i].value_or(0.001 * static_cast<double>(i + 1)), 0.001 * static_cast<double>(i + 1),
                1e-6);
  }
  const Statistics& statistics = direction.statistics();
  EXPECT_EQ(statistics.dropped, 10u);
  EXPECT_EQ(statistics.lost, 0u);
  EXPECT_NEAR(statistics.queue.percentile(50), 5, 0.11);
  EXPECT_NEAR(statistics.queue.percentile(99), 10, 0.11);
}

TEST(Direction, QueueEmptiesWithTime) {
  Direction direction({.bytesPerSecond = 100'000, .queueBytes = 200}, 0);
  for (const auto& time : send(direction, 50, 1ms)) EXPECT_NEAR(time.value(), 0.001, 1e-6);
  EXPECT_EQ(direction.statistics().dropped, 0u);
}

TEST(Direction, RefusesImpossibleConditions) {
  EXPECT_FALSE(errorOf({}));
  EXPECT_FALSE(errorOf({.loss = 0.5, .burstPackets = 1}));
  for (const Conditions& wrong : {Conditions{.loss = 1},
                                  {.loss = -0.1},
                                  {.loss = NAN},
                                  {.loss = 0.6, .burstPackets = 1},
                                  {.loss = 0.1, .burstPackets = 0.5},
                                  {.loss = 0.1, .burstPackets = 2, .burstTime = 1ms},
                                  {.bytesPerSecond = 1}})
    EXPECT_TRUE(errorOf(wrong));
}

TEST(DelayHistogram, HasNearestRankPercentiles) {
  DelayHistogram histogram;
  EXPECT_EQ(histogram.percentile(50), 0);
  for (int i = 1; i <= 100; ++i) histogram.add(i * 1ms);
  EXPECT_NEAR(histogram.percentile(50), 50, 1e-9);
  EXPECT_NEAR(histogram.percentile(99), 99, 1e-9);
  histogram.add(1h);
  EXPECT_NEAR(histogram.percentile(100), 10'000, 1e-9);
}

}  // namespace
}  // namespace clothstream::link
