// SPDX-License-Identifier: MIT
#include "server/schedule/price_watch.h"

#include <optional>

#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

// Runs a tick of equal slices. Returns the slice at which it is reported, 0 for its end, or nullopt if it is
// not reported.
std::optional<int> reportedAt(PriceWatch& watch, double price, int slices, double slice,
                              std::optional<double> device = std::nullopt) {
  watch.begin(price);
  for (int i = 1; i <= slices; ++i)
    if (watch.addSlice(slice)) return i;
  return watch.end(device) ? std::optional(0) : std::nullopt;
}

TEST(PriceWatchTest, ReportsAVeryLongTickBeforeItEnds) {
  PriceWatch watch;
  // Allowed are 0.2 s. The 13th slice of 0.1 s is the first with an excess above 1 s.
  EXPECT_EQ(reportedAt(watch, 0.02, 100, 0.1), 13);
  EXPECT_TRUE(watch.isExcessive(1));
}

TEST(PriceWatchTest, AddsUpTheExcessOfTicks) {
  PriceWatch watch;
  // Each tick takes 0.3 s more than allowed.
  for (int tick = 1; tick <= 3; ++tick) EXPECT_FALSE(reportedAt(watch, 0.02, 5, 0.1)) << tick;
  EXPECT_TRUE(reportedAt(watch, 0.02, 5, 0.1));
}

TEST(PriceWatchTest, ATickWithinThePriceReducesTheExcess) {
  PriceWatch watch;
  for (int tick = 1; tick <= 3; ++tick) EXPECT_FALSE(reportedAt(watch, 0.02, 5, 0.1));
  EXPECT_FALSE(reportedAt(watch, 0.1, 1, 0.1));  // 0.9 s below what is allowed: nothing is left
  for (int tick = 1; tick <= 3; ++tick) EXPECT_FALSE(reportedAt(watch, 0.02, 5, 0.1));
  EXPECT_TRUE(reportedAt(watch, 0.02, 5, 0.1));
}

TEST(PriceWatchTest, IgnoresShortTicks) {
  PriceWatch watch;
  for (int tick = 0; tick < 1000; ++tick) EXPECT_FALSE(reportedAt(watch, 0.0001, 3, 0.03));
}

TEST(PriceWatchTest, AMachineThatStandsStillIsNoExcess) {
  PriceWatch watch;
  for (int tick = 0; tick < 10; ++tick) {
    EXPECT_FALSE(reportedAt(watch, 0.01, 1, 5));
    for (int calm = 0; calm < 5; ++calm) EXPECT_FALSE(reportedAt(watch, 0.01, 1, 0.01));
  }
}

TEST(PriceWatchTest, WaitingForOtherWorkIsNoExcess) {
  PriceWatch watch;
  for (int tick = 0; tick < 20; ++tick) EXPECT_FALSE(reportedAt(watch, 0.02, 10, 0.1, 0.05));
}

TEST(PriceWatchTest, ExcusesTicksOnASlowDevice) {
  PriceWatch watch;
  EXPECT_EQ(reportedAt(watch, 0.02, 100, 0.1), 13);
  EXPECT_FALSE(watch.isExcessive(2));  // 1.3 s are less than 1 s above twice 0.2 s
  EXPECT_FALSE(watch.end(std::nullopt));
  EXPECT_FALSE(reportedAt(watch, 0.02, 2, 0.1));
  EXPECT_TRUE(watch.isExcessive(1));
}

// A slow device does not hide a tick that is far too long for it, however it was excused before.
TEST(PriceWatchTest, ReportsATickThatIsVeryLongForASlowDevice) {
  PriceWatch watch;
  EXPECT_EQ(reportedAt(watch, 0.02, 100, 0.1), 13);
  EXPECT_FALSE(watch.isExcessive(5.2));
  int slices = 14;
  while (!watch.addSlice(0.1)) ASSERT_LT(++slices, 100);
  EXPECT_EQ(slices, 21);  // 2.1 s are more than 1 s above 5.2 times 0.2 s
  EXPECT_TRUE(watch.isExcessive(5.2));
}

TEST(PriceWatchTest, ATickWithinThePriceEndsTheExcuse) {
  PriceWatch watch;
  EXPECT_EQ(reportedAt(watch, 0.02, 100, 0.1), 13);
  EXPECT_FALSE(watch.isExcessive(5));
  EXPECT_FALSE(watch.end(std::nullopt));
  EXPECT_FALSE(reportedAt(watch, 0.2, 1, 0.1));  // 2 s are allowed
  EXPECT_EQ(reportedAt(watch, 0.02, 100, 0.1), 13);
}

// A tick that was dropped, because its scene was reset or rebuilt, is forgotten.
TEST(PriceWatchTest, ATickThatDoesNotEndIsForgotten) {
  PriceWatch watch;
  for (int tick = 0; tick < 10; ++tick) {
    watch.begin(0.02);
    for (int i = 0; i < 10; ++i) EXPECT_FALSE(watch.addSlice(0.1));
  }
}

}  // namespace
}  // namespace clothstream::schedule
