// SPDX-License-Identifier: MIT
// Blame for lost devices, and consequences of faults for a scene.
#include <chrono>
#include <optional>

#include <gtest/gtest.h>

#include "server/hosting/harm_policy.h"
#include "server/hosting/loss_blame.h"
#include "server/hosting/rebuild_policy.h"

namespace clothstream::hosting {
namespace {

using namespace std::chrono_literals;

constexpr Clock::time_point kStart{1000s};

TEST(LossBlame, SecondLossWithinAMinuteCounts) {
  LossBlame blame;
  blame.count(kStart, true);
  EXPECT_FALSE(blame.take());
  blame.count(kStart + 60s - 1ms, true);
  EXPECT_TRUE(blame.take());
  EXPECT_FALSE(blame.take()) << "it was taken";
}

TEST(LossBlame, LaterLossCountsAsFirst) {
  LossBlame blame;
  blame.count(kStart, true);
  blame.count(kStart + 60s, true);
  EXPECT_FALSE(blame.take());
  blame.count(kStart + 61s, true);
  EXPECT_TRUE(blame.take());
}

TEST(LossBlame, SuspectsRunAloneAfterTheSecondLoss) {
  LossBlame blame;
  blame.count(kStart, false);
  EXPECT_FALSE(blame.isAlone(kStart));
  blame.count(kStart + 30s, false);
  EXPECT_FALSE(blame.take());
  EXPECT_TRUE(blame.isAlone(kStart + 90s - 1ms));
  EXPECT_FALSE(blame.isAlone(kStart + 90s));
  blame.count(kStart + 31s, true);
  EXPECT_TRUE(blame.take()) << "it ran alone";
}

TEST(LossBlame, SceneAloneNeedsNoIsolation) {
  LossBlame blame;
  blame.count(kStart, true);
  blame.count(kStart, true);
  EXPECT_FALSE(blame.isAlone(kStart));
}

TEST(HarmPolicy, CreatedSceneIsStoppedForGood) {
  HarmPolicy created(true);
  EXPECT_EQ(created.exceedsPrice(kStart), std::nullopt);
  EXPECT_EQ(created.losesDevice(), std::nullopt);
}

TEST(HarmPolicy, LossesLeaveOneMoreChance) {
  HarmPolicy policy(false);
  EXPECT_EQ(policy.losesDevice(), 0s);
  EXPECT_EQ(policy.losesDevice(), std::nullopt);
}

TEST(HarmPolicy, PausesGrowWhilePriceIsExceeded) {
  HarmPolicy policy(false);
  Clock::time_point now = kStart;
  for (const auto pause : {0s, 10s, 20s, 40s, 80s, 160s, 320s, 600s, 600s}) {
    EXPECT_EQ(policy.exceedsPrice(now), pause);
    now += pause + 1s;
  }
  EXPECT_EQ(policy.losesDevice(), 0s) << "prices take no chance away";
}

TEST(RebuildPolicy, SecondFailureWithinASecondEnds) {
  RebuildPolicy policy;
  EXPECT_TRUE(policy.tickFailed(100, 60));
  EXPECT_STREQ(policy.reason(), "a tick failed");
  EXPECT_FALSE(policy.tickFailed(159, 60));
}

TEST(RebuildPolicy, LaterFailureCountsAsFirst) {
  RebuildPolicy policy;
  EXPECT_TRUE(policy.tickFailed(100, 60));
  EXPECT_TRUE(policy.tickFailed(160, 60));
  policy.givenUp();
  EXPECT_TRUE(policy.tickFailed(161, 60));
}

TEST(RebuildPolicy, RebuildsOnceMoreAfterEachEvent) {
  RebuildPolicy policy;
  policy.tickFailed(100, 60);
  EXPECT_TRUE(policy.rebuildFailed());
  EXPECT_FALSE(policy.rebuildFailed());
  policy.deviceLost();
  EXPECT_STREQ(policy.reason(), "the device was lost");
  EXPECT_TRUE(policy.rebuildFailed());
  EXPECT_FALSE(policy.rebuildFailed());
}

}  // namespace
}  // namespace clothstream::hosting
