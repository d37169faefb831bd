// SPDX-License-Identifier: MIT
// Overload of a simulated device with a simulated clock: which scene reduces its work, and when.
#include "server/schedule/overload_policy.h"

#include <algorithm>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::Lt;
using testing::SizeIs;

constexpr Clock::duration kPeriod = 10ms;
constexpr std::uint32_t kRate = 100;

// A scene of 100 ticks and frames a second that shares a device with other work.
class LoadedScene {
 public:
  explicit LoadedScene(std::uint32_t substeps = 8, std::uint32_t streamRate = kRate)
      : policy(streamRate, substeps) {}

  // Runs this long. A tick needs `frame` (on average, without a divisor) and `substep` each; other work needs
  // the rest of the period except `left`.
  void run(Clock::duration time) {
    for (const Clock::time_point end = now + time; now < end;) {
      const WorkLevel level = policy.level(leastSubsteps);
      const Clock::duration own = frame / level.frameDivisor + level.substeps * substep;
      const Clock::duration taken = own + others;
      const Clock::duration idled = std::max(kPeriod - taken, Clock::duration::zero());
      idle += idled;
      now += taken + idled;
      const double slipped = std::max(static_cast<double>(taken.count()) / kPeriod.count() - 1, 0.0);
      if (policy.note({.now = now,
                       .slippedTicks = slipped,
                       .own = own,
                       .share = share,
                       .idle = idle,
                       .disturbed = disturbed},
                      leastSubsteps)) {
        levels.push_back(policy.level(leastSubsteps));
        changed.push_back(now);
      }
    }
  }

  OverloadPolicy policy;
  Clock::duration frame{}, substep{}, others{}, share = kPeriod, idle{};
  std::uint32_t leastSubsteps = 1;
  bool disturbed = false;
  Clock::time_point now{};
  std::vector<WorkLevel> levels;  // every change
  std::vector<Clock::time_point> changed;
};

TEST(OverloadPolicyTest, SceneThatFitsKeepsAllItsWork) {
  LoadedScene scene;
  scene.frame = 2ms;
  scene.substep = 900us;
  scene.run(60s);
  EXPECT_THAT(scene.levels, SizeIs(0));
  EXPECT_EQ(scene.policy.level(), (WorkLevel{1, 8}));
}

TEST(OverloadPolicyTest, ReducesFramesThenSubstepsThenNothing) {
  LoadedScene scene;
  scene.frame = 1ms;
  scene.substep = 20ms;
  scene.run(60s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{2, 8}, WorkLevel{4, 8}, WorkLevel{4, 6}, WorkLevel{4, 4},
                                        WorkLevel{4, 2}));
}

TEST(OverloadPolicyTest, StopsAtTheFirstLevelThatFits) {
  LoadedScene scene;
  scene.frame = 4ms;
  scene.substep = 1ms;
  scene.run(5s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{2, 8}));
  scene.substep = 1500us;
  scene.run(5s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{2, 8}, WorkLevel{4, 8}, WorkLevel{4, 6}));
}

TEST(OverloadPolicyTest, ReducesAtMostOnceASecond) {
  LoadedScene scene;
  scene.substep = 5ms;
  scene.run(20s);
  ASSERT_THAT(scene.changed, SizeIs(5));
  EXPECT_GE(scene.changed.front() - Clock::time_point{}, 1s);
  for (std::size_t i = 1; i < scene.changed.size(); ++i)
    EXPECT_GE(scene.changed[i] - scene.changed[i - 1], OverloadPolicy::kInterval);
}

TEST(OverloadPolicyTest, KeepsTheSubstepsThatStabilityNeeds) {
  LoadedScene scene(10);
  scene.substep = 20ms;
  scene.leastSubsteps = 7;
  scene.run(60s);
  EXPECT_THAT(scene.levels,
              ElementsAre(WorkLevel{2, 10}, WorkLevel{4, 10}, WorkLevel{4, 8}, WorkLevel{4, 7}));
  // A parameter change may raise the bound.
  EXPECT_EQ(scene.policy.level(9), (WorkLevel{4, 9}));
  EXPECT_EQ(scene.policy.level(10), (WorkLevel{4, 10}));
}

TEST(OverloadPolicyTest, KeepsTenFramesASecond) {
  LoadedScene slow(1, 24), slower(1, 12);
  for (LoadedScene* scene : {&slow, &slower}) {
    scene->substep = 50ms;
    scene->run(30s);
  }
  EXPECT_THAT(slow.levels, ElementsAre(WorkLevel{2, 1}));
  EXPECT_THAT(slower.levels, SizeIs(0));
}

TEST(OverloadPolicyTest, SceneWithinItsShareIsNotReducedForTheLoadOfAnother) {
  LoadedScene scene;
  scene.substep = 500us;
  scene.share = kPeriod / 2;
  scene.others = 100ms;
  scene.run(60s);
  EXPECT_THAT(scene.levels, SizeIs(0));
  // Its own work exceeds its share now.
  scene.substep = 600us;
  scene.run(2s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{2, 8}));
}

TEST(OverloadPolicyTest, LoadingAnotherSceneIsNoOverload) {
  LoadedScene scene;
  scene.substep = 2ms;
  scene.disturbed = true;
  scene.run(9s);
  EXPECT_THAT(scene.levels, SizeIs(0));
  scene.disturbed = false;
  scene.run(3s);
  EXPECT_EQ(scene.levels.front(), (WorkLevel{2, 8}));
}

TEST(OverloadPolicyTest, JudgesASceneWhileOthersAreLoadedAllTheTime) {
  LoadedScene scene;
  scene.substep = 20ms;
  scene.disturbed = true;
  scene.run(120s);
  EXPECT_THAT(scene.levels, SizeIs(5));
  EXPECT_GE(scene.changed.front() - Clock::time_point{}, OverloadPolicy::kLongestDisturbance);
}

TEST(OverloadPolicyTest, FrequentLoadsDoNotKeepASceneFromSteppingDownOrUp) {
  LoadedScene scene;
  const auto runWithLoads = [&](Clock::duration time) {
    for (const Clock::time_point end = scene.now + time; scene.now < end;) {
      scene.disturbed = !scene.disturbed;
      scene.run(400ms);
    }
  };
  scene.substep = 5ms;
  runWithLoads(16s);
  EXPECT_THAT(scene.levels, SizeIs(5)) << "a step for each second without a load";
  scene.substep = 500us;
  runWithLoads(240s);
  EXPECT_EQ(scene.policy.level(), (WorkLevel{1, 8}));
}

TEST(OverloadPolicyTest, TimeThatSlippedDuringALoadDoesNotCountAfterIt) {
  LoadedScene scene;
  scene.substep = 1150us;  // more than kMostUse of the share, and less than a period
  for (int i = 0; i < 30; ++i) {
    scene.run(700ms);
    scene.disturbed = true;
    scene.others = 300ms;
    scene.run(1ms);
    scene.disturbed = false;
    scene.run(1ms);
    scene.others = 0ms;
  }
  EXPECT_THAT(scene.levels, SizeIs(0));
}

TEST(OverloadPolicyTest, OneLongTickIsNoOverload) {
  LoadedScene scene;
  scene.substep = 500us;
  scene.run(5s);
  scene.substep = 10ms;
  scene.run(1ms);
  scene.substep = 500us;
  scene.run(60s);
  EXPECT_THAT(scene.levels, SizeIs(0));
}

TEST(OverloadPolicyTest, ReturnsInTheOppositeOrderAfterAPause) {
  LoadedScene scene;
  scene.frame = 1ms;
  scene.substep = 20ms;
  scene.run(60s);
  scene.levels.clear();
  scene.changed.clear();
  scene.substep = 500us;
  const Clock::time_point relieved = scene.now;
  scene.run(120s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{4, 4}, WorkLevel{4, 6}, WorkLevel{4, 8}, WorkLevel{2, 8},
                                        WorkLevel{1, 8}));
  Clock::time_point before = relieved;
  for (const Clock::time_point at : scene.changed) {
    EXPECT_GE(at - before, OverloadPolicy::kPause - OverloadPolicy::kInterval);
    before = at;
  }
}

TEST(OverloadPolicyTest, DoesNotReturnToALevelThatWouldNotFit) {
  LoadedScene scene;
  scene.substep = 1500us;  // six substeps take 9 ms of 10, and eight would take 12
  scene.run(600s);
  EXPECT_THAT(scene.levels, ElementsAre(WorkLevel{2, 8}, WorkLevel{4, 8}, WorkLevel{4, 6}));
}

// Frames cost more than the policy expects, so that every return fails.
TEST(OverloadPolicyTest, FailedReturnsBecomeRare) {
  LoadedScene scene;
  scene.frame = 8ms;
  scene.substep = 400us;  // 7.2 ms with half of the frames, 11.2 ms with all
  scene.share = kPeriod;
  scene.others = 0ms;
  scene.run(1h);
  ASSERT_FALSE(scene.levels.empty());
  EXPECT_EQ(scene.levels.front(), (WorkLevel{2, 8}));
  // One pair of changes for each pause: 10, 20, 40, 80 s, then 160 s.
  EXPECT_THAT(scene.levels.size(), Lt(2u * (4 + 3600 / 160) + 3));
}

TEST(OverloadPolicyTest, UsesTimeThatOtherScenesLeave) {
  LoadedScene scene;
  scene.share = kPeriod / 4;
  scene.substep = 700us;
  scene.others = 8ms;
  scene.run(5s);
  EXPECT_EQ(scene.policy.level().frameDivisor, 4u);
  scene.others = 500us;
  scene.run(120s);
  EXPECT_EQ(scene.policy.level(), (WorkLevel{1, 8}));
}

TEST(OverloadPolicyTest, BeginsAtTheLevelOfSavedWork) {
  for (const WorkLevel& work : {WorkLevel{1, 8}, WorkLevel{2, 8}, WorkLevel{4, 8}, WorkLevel{4, 4}}) {
    OverloadPolicy policy(kRate, 8);
    policy.beginAt(work);
    EXPECT_EQ(policy.level(), work);
  }
  // Stability needed 5 substeps at the level of 4.
  OverloadPolicy raised(kRate, 8);
  raised.beginAt({4, 5});
  EXPECT_EQ(raised.level(), (WorkLevel{4, 4}));
  EXPECT_EQ(raised.level(5), (WorkLevel{4, 5}));
}

TEST(OverloadPolicyTest, RestartBeginsAnInterval) {
  LoadedScene scene;
  scene.substep = 5ms;
  for (int i = 0; i < 20; ++i) {
    scene.run(900ms);
    scene.policy.restart();
  }
  EXPECT_THAT(scene.levels, SizeIs(0));
}

}  // namespace
}  // namespace clothstream::schedule
