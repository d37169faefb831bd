// SPDX-License-Identifier: MIT
// Fields of local winds, and what they cost: substeps and work.
#include "server/model/local_wind.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "server/model/price.h"
#include "server/model/stability.h"

namespace clothstream::model {
namespace {

using Vector = Eigen::Vector3d;

constexpr double kExact = 1e-5;  // sizes and the axis are floats

// At (1, 2, 3), along +X.
const Pose kPlace{Vec3(1, 2, 3),
                  Quaternion(Eigen::AngleAxisf(-std::numbers::pi_v<float> / 2, Vec3::UnitZ()))};

LocalWind fan() {
  return {kPlace, 8, Fan{.radius = 0.25f, .spread = 0.5f, .range = 2}};
}

LocalWind vortex() {
  return {kPlace, 8, Vortex{.radius = 0.25f, .reach = 2}};
}

// Velocity at a distance along the axis and across it.
Vector at(const LocalWind& wind, double along, double across) {
  return velocityAt({&wind, 1}, Vector(1 + along, 2 + across, 3));
}

TEST(Fan, BlowsFastestAtItsPlace) {
  EXPECT_LT((at(fan(), 0, 0) - Vector(8, 0, 0)).norm(), kExact);
  EXPECT_NEAR(at(fan(), 1, 0).x(), 8 * 0.75 * 0.75, kExact);
  EXPECT_NEAR(at(fan(), 1, 0.375).x(), 8 * std::pow(0.75, 4), kExact);
}

TEST(Fan, EndsAtRangeConeAndBack) {
  for (const double along : {-0.1, 0.0, 0.5, 1.9}) {
    const double edge = 0.25 + 0.5 * std::max(along, 0.0);
    EXPECT_GT(at(fan(), along, 0.9 * edge).x(), 0) << along;
    EXPECT_EQ(at(fan(), along, 1.001 * edge), Vector::Zero()) << along;
  }
  EXPECT_EQ(at(fan(), 2.001, 0), Vector::Zero());
  EXPECT_EQ(at(fan(), -0.251, 0), Vector::Zero());
  EXPECT_NEAR(at(fan(), -0.125, 0).x(), 8 * 0.75 * 0.75, kExact);
}

TEST(Vortex, TurnsAroundItsAxis) {
  EXPECT_LT(at(vortex(), 0.3, 0).norm(), kExact);
  const double fade = std::pow(1 - 0.25 * 0.25 / 4, 2);
  EXPECT_LT((at(vortex(), 0, 0.25) - Vector(0, 0, 8 * fade)).norm(), kExact);
  EXPECT_LT((at(vortex(), 0, -0.25) - Vector(0, 0, -8 * fade)).norm(), kExact);
  EXPECT_EQ(at(vortex(), 0, 2.001), Vector::Zero());
  EXPECT_EQ(at(vortex(), 2.001, 0.1), Vector::Zero());
}

TEST(LocalWind, NeverExceedsItsSpeedOrJumps) {
  for (const LocalWind& wind : {fan(), vortex()})
    for (double along = -0.5; along < 2.5; along += 0.05)
      for (double across = -2.5; across < 2.5; across += 0.05) {
        const Vector here = at(wind, along, across);
        ASSERT_LE(here.norm(), 8 + kExact);
        // Gradients are at most 4 speed / radius.
        const double step = 1e-3, change = 4 * 8 / 0.25 * step;
        ASSERT_LT((at(wind, along + step, across) - here).norm(), change);
        ASSERT_LT((at(wind, along, across + step) - here).norm(), change);
      }
}

TEST(LocalWind, WindsAddUp) {
  const std::vector<LocalWind> both{fan(), vortex()};
  const Vector point(1.2, 2.1, 3.05);
  const Vector sum = velocityAt({&both[0], 1}, point) + velocityAt({&both[1], 1}, point);
  EXPECT_LT((velocityAt(both, point) - sum).norm(), kExact);
  EXPECT_EQ(speedOf(both), 16);
}

Scene sailScene() {
  Cloth cloth;
  cloth.name = "sail";
  cloth.grid = {.rows = 20, .columns = 20, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.1f;
  cloth.drag = 10;
  Scene scene;
  scene.cloths = {cloth};
  scene.substeps = 20;
  return scene;
}

TEST(LocalWind, NeedsSubstepsForItsSpeed) {
  Scene scene = sailScene();
  const std::uint32_t still = stableSubsteps(scene);
  scene.winds = {{fan(), "fan"}};
  EXPECT_GT(stableSubsteps(scene), still);
  Scene windy = sailScene();
  windy.environment.wind = Vec3(0, 8, 0);
  EXPECT_EQ(stableSubsteps(scene), stableSubsteps(windy));
}

TEST(LocalWind, HasRoomUpToTheBound) {
  Scene scene = sailScene();
  const StabilityBound bound(scene);
  const float room = bound.roomForWind(scene, scene.substeps);
  ASSERT_GT(room, 1);
  ASSERT_LT(room, kMaxHeldSpeed);
  EXPECT_EQ(bound.roomForWind(scene, bound.substeps(scene) - 1), 0);
  scene.environment.wind = Vec3(room, 0, 0);
  EXPECT_LE(bound.substeps(scene), scene.substeps);
  scene.environment.wind = Vec3(1.01f * room, 0, 0);
  EXPECT_GT(bound.substeps(scene), scene.substeps);
  scene.cloths[0].drag = 0;
  EXPECT_EQ(bound.roomForWind(scene, scene.substeps), kMaxHeldSpeed);
}

TEST(LocalWind, IsPricedByCount) {
  Scene scene = sailScene();
  const PriceModel price(scene);
  const double still = price.work(scene).nodeSteps, one = price.heldWindWork(scene, 1).nodeSteps;
  EXPECT_GT(one, 0);
  scene.winds = {{fan(), "fan"}, {vortex(), "vortex"}};
  EXPECT_NEAR(price.work(scene).nodeSteps, still + 2 * one, 1e-9 * still);
  scene.environment.airDensity = 0;
  EXPECT_EQ(price.heldWindWork(scene, 1).nodeSteps, 0);
}

}  // namespace
}  // namespace clothstream::model
