// SPDX-License-Identifier: MIT
#include "server/delivery/queue_delay.h"

#include <chrono>
#include <cstdint>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

class QueueDelayTest : public testing::Test {
 protected:
  // One packet every 10 ms for a time, with this one-way delay.
  void pass(Clock::duration time, std::chrono::microseconds oneWay) {
    for (const auto end = now_ + time; now_ < end; now_ += 10ms)
      delay_.add(now_,
                 static_cast<std::uint32_t>(schedule::microseconds(now_) + kOffset) +
                     static_cast<std::uint32_t>(oneWay.count()),
                 now_ + oneWay);
  }

  static constexpr std::uint64_t kOffset = 1'234'567'890'123;  // between the clocks, us
  Clock::time_point now_{1h};
  QueueDelay delay_;
};

TEST_F(QueueDelayTest, IsTheDelayAboveTheBase) {
  pass(1s, 20ms);
  EXPECT_EQ(delay_.newest(), 0);
  pass(1s, 50ms);
  EXPECT_NEAR(delay_.newest(), 0.03, 1e-6);
  EXPECT_NEAR(delay_.filtered(), 0.03, 1e-3);
  pass(10ms, 5ms);
  EXPECT_EQ(delay_.filtered(), 0) << "a lower base counts at once";
}

TEST_F(QueueDelayTest, SingleDelaysCountForLittle) {
  pass(1s, 20ms);
  pass(10ms, 400ms);
  EXPECT_LE(delay_.filtered(), 0.01);
  pass(10ms, 20ms);
  EXPECT_EQ(delay_.filtered(), 0);
}

TEST_F(QueueDelayTest, LongerRouteBecomesTheBase) {
  pass(5s, 20ms);
  pass(26s, 60ms);
  EXPECT_NEAR(delay_.newest(), 0.04, 1e-6);
  pass(5s, 60ms);
  EXPECT_EQ(delay_.newest(), 0);
}

TEST_F(QueueDelayTest, WrappingClockChangesNothing) {
  pass(2h, 20ms);
  EXPECT_EQ(delay_.newest(), 0);
  EXPECT_EQ(delay_.filtered(), 0);
}

TEST_F(QueueDelayTest, PauseForgetsTheBase) {
  pass(1s, 20ms);
  now_ += 60s;
  pass(1s, 60ms);
  EXPECT_EQ(delay_.newest(), 0);
}

}  // namespace
}  // namespace clothstream::delivery
