// SPDX-License-Identifier: MIT
// Linear systems on the device: the same bits whoever solves them, in whatever pieces.
#include <utility>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

class Solve : public GpuTest {};

scene::Cloth named(const char* name, scene::Cloth cloth, scene::SolverKind kind) {
  cloth.name = name;
  cloth.solver.kind = kind;
  if (!cloth.mesh) cloth.pins = {topRow(cloth)};
  return cloth;
}

// A grid and a mesh of each kind, so soft that ACAD has something to hold; and a ball.
scene::Scene systems() {
  using enum scene::SolverKind;
  scene::Scene scene = sceneOf(
      {named("held", calmCloth(37, 29), constraint), named("adaptive", calmCloth(30, 41), acad),
       named("implicit", calmCloth(33, 18), implicitEuler), named("disc", discCloth(10), constraint),
       named("adaptive disc", discCloth(5), acad), named("implicit disc", discCloth(8), implicitEuler),
       named("small", calmCloth(5, 3), constraint)});
  for (scene::Cloth& cloth : scene.cloths) {
    if (cloth.mesh) cloth.pinnedVertices = {0, 1};
    if (cloth.solver.kind == acad) {
      cloth.structural = {8, 0.01f};
      cloth.shear = {4, 0.01f};
      cloth.bend = {1, 0.01f};
    }
  }
  scene.cloths[0].solver.bendConstraints = true;
  scene.cloths[3].solver.iterations = 7;
  scene.cloths[6].solver.tolerance = 0.1f;
  scene.substeps = 4;
  return scene;
}

simulation::TickInputs inputsAt(const scene::Scene& scene, int tick) {
  const auto place = [](int t) {
    return scene::Pose{scene::Vec3(0.02f, -0.15f, 0.2f - 0.005f * static_cast<float>(t % 80)), {}};
  };
  return inputsOf(scene, {{scene::Sphere{0.08f}, place(tick), place(tick + 1), 1}});
}

TEST_F(Solve, givesTheSameBitsHoweverTheWorkIsCut) {
  const scene::Scene scene = systems();
  std::uint64_t first = 0;
  std::vector<shared::SolveRecord> solves;
  for (const auto& [workgroup, wholeNodes] :
       {std::pair{8u, 1'000'000u}, {8u, 0u}, {0u, 700u}, {16u, 700u}, {64u, 0u}, {100u, 1'000'000u}}) {
    SCOPED_TRACE(::testing::Message() << workgroup << ", " << wholeNodes);
    Running running(scene, {.workgroupSize = workgroup, .solveWholeNodes = wholeNodes});
    simulation::TickStatus status;
    for (int tick = 0; tick < 10; ++tick) status = running.tick(inputsAt(scene, tick));
    EXPECT_TRUE(status.healthy);
    if (first == 0) first = status.stateHash;
    EXPECT_EQ(status.stateHash, first);
  }
}

// What it says of itself too; the systems' order alone depends on who solves which.
TEST_F(Solve, reportsTheSameWhoeverSolves) {
  const scene::Scene scene = systems();
  Running whole(scene, {.solveWholeNodes = 1'000'000}), parts(scene, {.solveWholeNodes = 0});
  for (int tick = 0; tick < 10; ++tick) {
    const auto one = whole.tickAndReport(inputsAt(scene, tick)),
               other = parts.tickAndReport(inputsAt(scene, tick));
    for (std::size_t i = 0; i < one.size(); ++i) {
      SCOPED_TRACE(::testing::Message() << scene.cloths[i].name << ", tick " << tick);
      EXPECT_EQ(one[i].iterations, other[i].iterations);
      EXPECT_EQ(one[i].residual, other[i].residual);
      EXPECT_EQ(one[i].activeConstraints, other[i].activeConstraints);
      EXPECT_LE(one[i].iterations, scene.cloths[i].solver.iterations);
      if (one[i].iterations < scene.cloths[i].solver.iterations) {
        EXPECT_LE(one[i].residual, scene.cloths[i].solver.tolerance);
      }
      if (i == 1) {
        EXPECT_LT(one[i].activeConstraints, 4u * 30 * 41 / 2);
      }
    }
  }
  EXPECT_GT(whole.tickAndReport(inputsAt(scene, 10))[1].activeConstraints, 0u);
}

TEST_F(Solve, givesTheSameHashesInRunsOfAThousandTicks) {
  scene::Scene scene = systems();
  scene.substeps = 1;
  scene.simulationRate = 288;
  for (scene::Cloth& cloth : scene.cloths) cloth.solver.iterations = 4;
  Running one(scene), again(scene), other(scene, {.workgroupSize = 16, .solveWholeNodes = 0});
  for (int tick = 0; tick < 1000; ++tick) {
    const simulation::TickInputs inputs = inputsAt(scene, tick);
    const simulation::TickStatus status = one.tick(inputs);
    ASSERT_TRUE(status.healthy) << tick;
    ASSERT_EQ(again.tick(inputs).stateHash, status.stateHash) << tick;
    if (tick < 100) {
      ASSERT_EQ(other.tick(inputs).stateHash, status.stateHash) << tick;
    }
  }
}

// The same number on every device.
TEST_F(Solve, reachesTheHashOfEveryOtherDevice) {
  const scene::Scene scene = systems();
  Running running(scene, {.solveWholeNodes = 700});
  simulation::TickStatus status;
  for (int tick = 0; tick < 12; ++tick) status = running.tick(inputsAt(scene, tick));
  EXPECT_EQ(status.stateHash, 0x8238f727263d17eau);
}

}  // namespace
}  // namespace clothstream::tests
