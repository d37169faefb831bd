// SPDX-License-Identifier: MIT
// Local winds on the device: the same bits for every partition of the work, far from the world's origin, and
// without a wind nearby.
#include <array>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::Vec3;

class LocalWinds : public GpuTest {};

model::Scene windyScene(const Vec3& place = Vec3::Zero()) {
  model::Cloth curtain = calmCloth(13, 11);
  curtain.grid.pose.position = place;
  curtain.pins = {topRow(curtain)};
  curtain.drag = 0.6f;
  curtain.lift = 0.4f;
  model::Scene scene = sceneOf({curtain});
  scene.winds = {{{{place + Vec3(0, -0.125f, -0.25f), turned(90, Vec3::UnitX())},
                   6,
                   model::Fan{.radius = 0.125f, .range = 1}},
                  "fan"},
                 {{{place + Vec3(0.0625f, -0.25f, 0), turned(30, Vec3(1, 2, 0.5f))},
                   4,
                   model::Vortex{.radius = 0.125f, .reach = 0.5f}},
                  "vortex"}};
  return scene;
}

simulation::TickInputs inputs(const model::Scene& scene, int) {
  return inputsOf(scene);
}

TEST_F(LocalWinds, GiveTheSameBitsForEveryPartition) {
  constexpr std::array<simulation::SimulationOptions, 3> kWays{
      simulation::SimulationOptions{},
      {.rowsPerInvocation = 1, .workgroupSize = 32, .advanceKernel = {}},
      {.rowsPerInvocation = 7, .workgroupSize = 128, .advanceKernel = {}}};
  const model::Scene scene = windyScene();
  expectSameBits(scene, inputs, 5, kWays);
  model::Scene still = scene;
  still.winds.clear();
  EXPECT_NE(hashAfter(still, inputs, 5), hashAfter(scene, inputs, 5));
}

TEST_F(LocalWinds, BlowFarFromTheOriginAlike) {
  const Vec3 far(640, -128, 64);
  EXPECT_EQ(hashAfter(windyScene(far), inputs, 5), hashAfter(windyScene(), inputs, 5));
}

TEST_F(LocalWinds, ChangeNoBitOutOfReach) {
  model::Scene still = windyScene();
  still.winds.clear();
  still.environment.wind = Vec3(1, 0, 3);
  model::Scene away = still;
  away.winds = windyScene(Vec3(5, 0, 0)).winds;
  EXPECT_EQ(hashAfter(away, inputs, 5), hashAfter(still, inputs, 5));
}

// The kernel changes when a wind begins and ends.
TEST_F(LocalWinds, BeginAndEndWhileTheSceneRuns) {
  const model::Scene scene = windyScene();
  model::Scene still = scene;
  still.winds.clear();
  Running begins(still), always(scene);
  const simulation::StateSnapshot start = begins.save();
  const std::uint64_t windless = begins.tick(inputsOf(still)).stateHash;
  begins.restore(start);
  EXPECT_EQ(begins.tick(inputsOf(scene)).stateHash, always.tick(inputsOf(scene)).stateHash);
  begins.restore(start);
  EXPECT_EQ(begins.tick(inputsOf(still)).stateHash, windless);
}

}  // namespace
}  // namespace clothstream::tests
