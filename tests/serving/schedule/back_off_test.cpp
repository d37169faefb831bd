// SPDX-License-Identifier: MIT
#include "server/schedule/back_off.h"

#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;

TEST(BackOff, PausesGrowWhileItFails) {
  BackOff backOff(10s, 60s);
  Clock::time_point now{};
  EXPECT_EQ(backOff.fail(now), 0s);
  for (const auto pause : {10s, 20s, 40s, 60s, 60s}) {
    now += 60s - 1ms;
    EXPECT_EQ(backOff.fail(now), pause);
    now += pause;
  }
}

TEST(BackOff, ForgetsAfterAQuietTime) {
  BackOff backOff(10s, 60s);
  Clock::time_point now{};
  backOff.fail(now);
  EXPECT_EQ(backOff.fail(now), 10s);
  EXPECT_EQ(backOff.fail(now += 70s), 0s);
  EXPECT_EQ(backOff.fail(now), 10s);
}

}  // namespace
}  // namespace clothstream::schedule
