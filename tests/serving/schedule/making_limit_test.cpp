// SPDX-License-Identifier: MIT
#include "server/schedule/making_limit.h"

#include <chrono>

#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;

constexpr Clock::time_point kBegin{1h};

TEST(MakingLimitTest, KnowsWhatWasPaidForInThisTick) {
  MakingLimit limit;
  limit.beginTick();
  EXPECT_FALSE(limit.made());
  limit.pay(kBegin, 0.01);
  EXPECT_TRUE(limit.made());
  limit.beginTick();
  EXPECT_FALSE(limit.made());
}

TEST(MakingLimitTest, ChangesWaitUntilEarlierOnesArePaidFor) {
  MakingLimit limit;
  limit.beginTick();
  ASSERT_TRUE(limit.allows(kBegin));
  limit.pay(kBegin, MakingLimit::kBurst + 0.1);  // 0.1 s too much, which take 2 s
  limit.beginTick();
  EXPECT_FALSE(limit.allows(kBegin + 1900ms));
  EXPECT_TRUE(limit.allows(kBegin + 2100ms));
}

TEST(MakingLimitTest, TakesTheShareInTheLongRun) {
  MakingLimit limit;
  double made = 0;
  for (auto now = kBegin; now < kBegin + 100s; now += 10ms) {
    limit.beginTick();
    if (!limit.allows(now)) continue;
    limit.pay(now, 0.08);
    made += 0.08;
  }
  EXPECT_LE(made, MakingLimit::kBurst + 100 * MakingLimit::kShare + 0.08);
  EXPECT_GE(made, 100 * MakingLimit::kShare);
}

}  // namespace
}  // namespace clothstream::schedule
