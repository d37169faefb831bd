// SPDX-License-Identifier: MIT
// Due times of ticks, detection of slow scenes, rate limits.
#include <gtest/gtest.h>

#include "server/schedule/pacer.h"
#include "server/schedule/slow_watch.h"
#include "server/schedule/token_bucket.h"

namespace clothstream::schedule {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

const Clock::time_point kStart = Clock::time_point(hours(5));

TEST(Pacer, KeepsTheTickRateWithoutDrift) {
  Pacer pacer(72);
  pacer.start(kStart);
  EXPECT_EQ(pacer.due(), kStart);
  for (int tick = 0; tick < 72 * 3600; ++tick) pacer.begin(pacer.due());
  EXPECT_EQ(pacer.due(), kStart + hours(1));
}

TEST(Pacer, TickIsLateAfterAQuarterOfAPeriod) {
  Pacer pacer(100);
  pacer.start(kStart);
  EXPECT_FALSE(pacer.begin(kStart + milliseconds(2)).late);
  const Pacer::Start late = pacer.begin(kStart + milliseconds(13));
  EXPECT_TRUE(late.late);
  EXPECT_EQ(late.lateness, milliseconds(3));
  EXPECT_EQ(late.slippedTicks, 0);
}

TEST(Pacer, CatchesUpOneTickAndSlipsTheRest) {
  Pacer pacer(100);
  pacer.start(kStart);
  pacer.begin(kStart);
  // This is 35 ms after the tick was due (10 ms). One period may be caught up; 25 ms are given up.
  const Clock::time_point now = kStart + milliseconds(45);
  const Pacer::Start start = pacer.begin(now);
  EXPECT_EQ(start.lateness, milliseconds(35));
  EXPECT_DOUBLE_EQ(start.slippedTicks, 2.5);
  // The next tick is due at once, the one after it a period later.
  EXPECT_EQ(pacer.due(), now);
  EXPECT_EQ(pacer.begin(now).slippedTicks, 0);
  EXPECT_EQ(pacer.due(), now + milliseconds(10));
}

TEST(SlowWatch, ReportsASlowSceneAtMostEveryTenSeconds) {
  SlowWatch watch;
  int reports = 0;
  // For 20 s every tick of 10 ms takes 20 ms, which is half of real time.
  for (int tick = 0; tick < 1'000; ++tick)
    if (const auto speed = watch.note(kStart + milliseconds(20) * tick, tick == 0 ? 0 : 1)) {
      EXPECT_NEAR(*speed, 0.5, 0.01);  // the first interval starts with a tick without slip
      ++reports;
    }
  EXPECT_EQ(reports, 2);  // after 2 s, and more than 10 s later
}

TEST(SlowWatch, IgnoresSmallSlowdowns) {
  SlowWatch watch;
  // Every tick of 10 ms takes 10.3 ms, which is 97 % of real time.
  for (int tick = 0; tick < 1'000; ++tick)
    EXPECT_FALSE(watch.note(kStart + std::chrono::microseconds(10'300) * tick, 0.03)) << tick;
}

TEST(SlowWatch, IgnoresASingleDelay) {
  SlowWatch watch;
  for (int tick = 0; tick < 1'000; ++tick)
    EXPECT_FALSE(watch.note(kStart + milliseconds(10) * tick, tick == 500 ? 1.5 : 0)) << tick;
}

TEST(TokenBucket, AllowsABurstThenTheRate) {
  TokenBucket bucket(10, 5);
  int taken = 0;
  for (int i = 0; i < 20; ++i) taken += bucket.take(kStart);
  EXPECT_EQ(taken, 5);
  // In 2 s the rate allows 20 more.
  taken = 0;
  for (int i = 1; i <= 200; ++i) taken += bucket.take(kStart + milliseconds(10) * i);
  EXPECT_NEAR(taken, 20, 1);
  // A long pause allows no more than the burst.
  taken = 0;
  for (int i = 0; i < 20; ++i) taken += bucket.take(kStart + hours(1));
  EXPECT_EQ(taken, 5);
}

TEST(TokenBucket, TakesNothingIfTheCostIsTooHigh) {
  TokenBucket bucket(1, 10);
  EXPECT_FALSE(bucket.take(kStart, 11));
  EXPECT_TRUE(bucket.take(kStart, 10));
}

}  // namespace
}  // namespace clothstream::schedule
