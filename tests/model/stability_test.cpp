// SPDX-License-Identifier: MIT
// Stability bound compared with numbers computed by hand. tests/reference compares it with simulations.
#include "server/model/stability.h"

#include <cmath>

#include <gtest/gtest.h>

namespace clothstream::model {
namespace {

Scene sheet(std::uint32_t rows, std::uint32_t columns) {
  Scene scene;
  scene.environment.airDensity = 0;
  scene.simulationRate = 100;
  Cloth cloth;
  cloth.grid = {.rows = rows, .columns = columns};
  cloth.mass = 0.01f * static_cast<float>(rows * columns);
  cloth.structural.stiffness = 500;
  scene.cloths = {cloth};
  return scene;
}

// Bound: s = h^2 2 sum(w) / m < 4, with the sum of stiffnesses at the worst node.
std::uint32_t substepsFor(double stiffnessSum) {
  return static_cast<std::uint32_t>(std::floor(0.01 * std::sqrt(2 * stiffnessSum / 0.01 / 4))) + 1;
}

TEST(StableSubsteps, FollowFromTheSpringsAtTheWorstNode) {
  Scene scene = sheet(10, 10);
  EXPECT_EQ(stableSubsteps(scene), substepsFor(4 * 500));
  scene.cloths[0].shear.stiffness = 300;
  scene.cloths[0].bend.stiffness = 200;
  EXPECT_EQ(stableSubsteps(scene), substepsFor(4 * 500 + 4 * 300 + 4 * 200));
}

TEST(StableSubsteps, CountOnlySpringsThatExist) {
  Scene scene = sheet(2, 2);
  scene.cloths[0].shear.stiffness = 5000;
  scene.cloths[0].bend.stiffness = 1e6f;
  EXPECT_EQ(stableSubsteps(scene), substepsFor(2 * 500 + 1 * 5000));
}

// With three rows, nodes with a bend spring along the column are not those with two structural springs.
TEST(StableSubsteps, ConsiderAllIncomparableNodes) {
  Scene scene = sheet(3, 2);
  scene.cloths[0].bend.stiffness = 2000;
  EXPECT_EQ(stableSubsteps(scene), substepsFor(2 * 500 + 2000));
  scene.cloths[0].bend.stiffness = 1;
  EXPECT_EQ(stableSubsteps(scene), substepsFor(3 * 500));
}

TEST(StableSubsteps, IgnorePinnedNodes) {
  Scene scene = sheet(3, 3);
  scene.cloths[0].pins = {{.firstRow = 1, .lastRow = 1, .firstColumn = 0, .lastColumn = 2}};
  EXPECT_EQ(stableSubsteps(scene), substepsFor(3 * 500));
}

// The bound is made once for a scene and asked after each change of its parameters.
TEST(StabilityBound, HoldsForChangedParameters) {
  Scene scene = sheet(10, 10);
  const StabilityBound bound(scene);
  EXPECT_EQ(bound.substeps(scene), substepsFor(4 * 500));
  Cloth& cloth = scene.cloths[0];
  cloth.shear.stiffness = 300;
  EXPECT_EQ(bound.substeps(scene), substepsFor(4 * 500 + 4 * 300));
  cloth.mass /= 4;
  EXPECT_EQ(bound.substeps(scene), substepsFor(4 * (4 * 500 + 4 * 300)));
  cloth.dihedralBending = 1;
  EXPECT_EQ(bound.substeps(scene), stableSubsteps(scene));
  EXPECT_GT(bound.substeps(scene), substepsFor(4 * (4 * 500 + 4 * 300)));
  cloth.structural.stiffness = 1e9f;
  EXPECT_EQ(bound.substeps(scene), 0u);
}

TEST(StableSubsteps, GrowWithDampingOfSpringsOfNodesAndOfTheAir) {
  const std::uint32_t bare = stableSubsteps(sheet(10, 10));
  Scene dashpots = sheet(10, 10), damped = sheet(10, 10), windy = sheet(10, 10);
  dashpots.cloths[0].structural.damping = 1;
  damped.cloths[0].damping = 900;
  windy.environment.airDensity = 1.2f;
  windy.environment.wind = Vec3(50, 0, 0);
  windy.cloths[0].drag = 10;
  EXPECT_GT(stableSubsteps(dashpots), bare);
  EXPECT_GT(stableSubsteps(damped), bare);
  EXPECT_GT(stableSubsteps(windy), bare);
}

TEST(StableSubsteps, FollowTheMostDemandingCloth) {
  Scene scene = sheet(10, 10);
  Cloth stiff = scene.cloths[0];
  stiff.structural.stiffness = 5000;
  scene.cloths = {scene.cloths[0], stiff, scene.cloths[0]};
  EXPECT_EQ(stableSubsteps(scene), substepsFor(4 * 5000));
}

TEST(StableSubsteps, AreOneForAFullyPinnedCloth) {
  Scene scene = sheet(3, 3);
  scene.cloths[0].structural.stiffness = 1e6f;
  scene.cloths[0].pins = {{.firstRow = 0, .lastRow = 2, .firstColumn = 0, .lastColumn = 2}};
  EXPECT_EQ(stableSubsteps(scene), 1u);
}

TEST(StableSubsteps, IgnoreSpringsOfXpbd) {
  Scene scene = sheet(10, 10);
  scene.cloths[0].structural = scene.cloths[0].bend = {1e6f, 1e4f};
  scene.cloths[0].solver.kind = SolverKind::xpbd;
  EXPECT_EQ(stableSubsteps(scene), 1u);
  // The damping of the cloth is explicit: h c < 2.
  scene.cloths[0].damping = 500;
  EXPECT_EQ(stableSubsteps(scene), 3u);
}

TEST(StableSubsteps, AreZeroIfTheMaximumIsNotEnough) {
  Scene scene = sheet(10, 10);
  scene.cloths[0].structural.stiffness = 1e6f;
  scene.simulationRate = 1;
  EXPECT_EQ(stableSubsteps(scene), 0u);
}

TEST(StableSubsteps, NeedDashpotsAndDampingForExplicitEuler) {
  Scene scene = sheet(10, 10);
  scene.integrator = Integrator::explicitEuler;
  EXPECT_EQ(stableSubsteps(scene), 0u);
  scene.cloths[0].structural.damping = 0.5f;
  EXPECT_EQ(stableSubsteps(scene), 0u);
  scene.cloths[0].damping = 50;
  // Across the springs, h 500 (1 - 1/1.1) 2 * 4 / 0.01 <= 50 needs h <= 1/727 s. Along them, h 500 <= 0.5
  // needs h <= 1/1000 s if the damping carries only the tension. c = h (2 * 4 * 0.5 / 0.01 + 50) < 2 is
  // easier. Between 7.27 and 10 substeps the deficit along the springs is larger: h 500 - 0.5 <= 0.0625 gives
  // h <= 1/889 s.
  EXPECT_EQ(stableSubsteps(scene), 9u);
}

}  // namespace
}  // namespace clothstream::model
