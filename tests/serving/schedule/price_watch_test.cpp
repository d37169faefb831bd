// SPDX-License-Identifier: MIT
#include "server/schedule/price_watch.h"

#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

TEST(PriceWatchTest, ReportsTheFifthTickInARow) {
  PriceWatch watch;
  for (int tick = 1; tick <= 4; ++tick) EXPECT_FALSE(watch.note(1.1, 0.1));
  EXPECT_TRUE(watch.note(1.1, 0.1));
  EXPECT_TRUE(watch.isExcessive(1));
}

TEST(PriceWatchTest, CheapTickStartsTheCountAgain) {
  PriceWatch watch;
  for (int tick = 1; tick <= 4; ++tick) EXPECT_FALSE(watch.note(1.1, 0.1));
  EXPECT_FALSE(watch.note(0.9, 0.1));
  for (int tick = 1; tick <= 4; ++tick) EXPECT_FALSE(watch.note(1.1, 0.1));
  EXPECT_TRUE(watch.note(1.1, 0.1));
}

TEST(PriceWatchTest, IgnoresShortTicks) {
  PriceWatch watch;
  for (int tick = 0; tick < 100; ++tick) EXPECT_FALSE(watch.note(0.09, 0.0001));
}

TEST(PriceWatchTest, ExcusesTicksOnASlowDevice) {
  PriceWatch watch;
  for (int tick = 1; tick <= 4; ++tick) EXPECT_FALSE(watch.note(2, 0.1));
  EXPECT_TRUE(watch.note(1.5, 0.1));
  EXPECT_FALSE(watch.isExcessive(1.6));  // the cheapest tick took 15 times its price
  for (int tick = 1; tick <= 4; ++tick) EXPECT_FALSE(watch.note(2, 0.1));
  EXPECT_TRUE(watch.note(2, 0.1));
  EXPECT_TRUE(watch.isExcessive(1.6));
}

}  // namespace
}  // namespace clothstream::schedule
