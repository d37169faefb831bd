// SPDX-License-Identifier: MIT
// Checkpoints, recoveries, and the parameters to which a scene goes back.
#include "server/scene/scene_recovery.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using Cure = SceneRecovery::Cure;

constexpr std::uint64_t kTicksPerSecond = 40;

model::Scene withWind(float x) {
  model::Scene scene = tests::smallScene();
  scene.environment.wind = model::Vec3(x, 0, 0);
  return scene;
}

// Runs healthy ticks until `tick`.
void run(SceneRecovery& recovery, std::uint64_t& tick, std::uint64_t until, const model::Scene& scene) {
  while (tick < until) recovery.healthy(++tick, scene);
}

TEST(SceneRecovery, KeepsStatesOfHealthySeconds) {
  const model::Scene scene = tests::smallScene();
  SceneRecovery recovery(scene);
  std::vector<std::uint64_t> checkpoints, snapshots;
  for (std::uint64_t tick = 0; tick < 6 * kTicksPerSecond;) {
    if (recovery.checkpointDue()) checkpoints.push_back(tick);
    if (recovery.snapshotDue()) snapshots.push_back(tick);
    run(recovery, tick, tick + 1, scene);
    if (tick == 50) {
      EXPECT_EQ(recovery.unhealthy(++tick, false), Cure::rollback);
    }
  }
  EXPECT_EQ(checkpoints, (std::vector<std::uint64_t>{40, 91, 131, 171, 211}));
  EXPECT_EQ(snapshots, std::vector<std::uint64_t>());
  std::uint64_t tick = 6 * kTicksPerSecond;
  run(recovery, tick, 251, scene);
  EXPECT_TRUE(recovery.snapshotDue());
}

TEST(SceneRecovery, EachRecoveryActsOnce) {
  SceneRecovery recovery(tests::smallScene());
  EXPECT_EQ(recovery.take(), Recovery::none);
  EXPECT_EQ(recovery.unhealthy(1, false), Cure::rollback);
  EXPECT_EQ(recovery.next(), Recovery::rollback);
  EXPECT_EQ(recovery.take(), Recovery::rollback);
  EXPECT_EQ(recovery.next(), Recovery::none);
  EXPECT_EQ(recovery.unhealthy(2, true), Cure::resetAndLetGo);
  EXPECT_EQ(recovery.next(), Recovery::reset);
  EXPECT_TRUE(recovery.ignoresParticipants(2));
  EXPECT_EQ(recovery.newestFailure(), 2u);
}

TEST(SceneRecovery, ResetAndNewDeviceHaveNoHealthyTick) {
  const model::Scene scene = tests::smallScene();
  SceneRecovery recovery(scene);
  std::uint64_t tick = 0;
  run(recovery, tick, 40, scene);
  EXPECT_TRUE(recovery.isHealthy());
  EXPECT_TRUE(recovery.checkpointDue());
  recovery.reset();
  EXPECT_EQ(recovery.next(), Recovery::reset);
  EXPECT_FALSE(recovery.isHealthy());
  EXPECT_FALSE(recovery.checkpointDue());
  recovery.rebuilt();
  EXPECT_EQ(recovery.next(), Recovery::none);
  EXPECT_FALSE(recovery.isHealthy());
}

TEST(SceneRecovery, GoesBackToProvenParameters) {
  SceneRecovery recovery(withWind(0));
  std::uint64_t tick = 0;
  recovery.changed(tick, withWind(1));
  run(recovery, tick, 20, withWind(1));
  recovery.changed(tick, withWind(2));
  EXPECT_EQ(recovery.proven().environment.wind.x(), 0);
  run(recovery, tick, 40, withWind(2));
  EXPECT_EQ(recovery.proven().environment.wind.x(), 1) << "a second has proven it, the newer one not";
  run(recovery, tick, 80, withWind(2));
  EXPECT_EQ(recovery.proven().environment.wind.x(), 2);
  recovery.changed(tick, withWind(3));
  recovery.unhealthy(81, false);
  EXPECT_EQ(recovery.unhealthy(82, false), Cure::resetAndUndo);
  EXPECT_EQ(recovery.proven().environment.wind.x(), 2);
}

TEST(SceneRecovery, ProvenParametersAreNotEased) {
  model::Scene scene = tests::smallScene();
  SceneRecovery recovery(scene);
  scene.cloths[0].solver.correctionFraction = 0.02f;
  std::uint64_t tick = 0;
  recovery.changed(tick, scene);
  run(recovery, tick, 40, scene);
  EXPECT_FALSE(recovery.proven().cloths[0].solver.correctionFraction);
}

}  // namespace
}  // namespace clothstream::scene
