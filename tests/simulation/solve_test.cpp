// SPDX-License-Identifier: MIT
// Linear systems on the device: the same bits for every partition of the work.
#include <utility>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

class Solve : public GpuTest {};

model::Cloth named(const char* name, model::Cloth cloth, model::SolverKind kind) {
  cloth.name = name;
  cloth.solver.kind = kind;
  if (!cloth.mesh) cloth.pins = {topRow(cloth)};
  return cloth;
}

// A grid and a mesh for each solver, so soft that ACAD activates constraints, and a ball.
model::Scene solvedScene() {
  using enum model::SolverKind;
  model::Scene scene = sceneOf(
      {named("held", calmCloth(37, 29), constraint), named("adaptive", calmCloth(30, 41), acad),
       named("implicit", calmCloth(33, 18), implicitEuler), named("disc", discCloth(10), constraint),
       named("adaptive disc", discCloth(5), acad), named("implicit disc", discCloth(8), implicitEuler),
       named("small", calmCloth(5, 3), constraint)});
  for (model::Cloth& cloth : scene.cloths) {
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

TEST_F(Solve, GivesTheSameBitsForEveryPartitionOfWork) {
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 1'000'000},
                                                {.workgroupSize = 8, .solveWholeNodes = 0},
                                                {.workgroupSize = 0, .solveWholeNodes = 700},
                                                {.workgroupSize = 16, .solveWholeNodes = 700},
                                                {.workgroupSize = 64, .solveWholeNodes = 0},
                                                {.workgroupSize = 100, .solveWholeNodes = 1'000'000}};
  expectSameBits(solvedScene(), passingBall, 10, ways);
}

// The reports are the same too. Only the order of the systems depends on the partition.
TEST_F(Solve, ReportsTheSameForEveryPartitionOfWork) {
  const Reports reports =
      expectSameReports(solvedScene(), passingBall, {.solveWholeNodes = 1'000'000}, {.solveWholeNodes = 0});
  for (const auto& tick : reports) EXPECT_LT(tick[1].activeConstraints, 4u * 30 * 41 / 2);
  EXPECT_GT(reports.back()[1].activeConstraints, 0u);
}

TEST_F(Solve, GivesTheSameHashesInLongRuns) {
  model::Scene scene = solvedScene();
  scene.substeps = 1;
  scene.simulationRate = 288;
  for (model::Cloth& cloth : scene.cloths) cloth.solver.iterations = 4;
  expectSameLongRuns(scene, passingBall, {.workgroupSize = 16, .solveWholeNodes = 0});
}

// The hash is the same on every device.
TEST_F(Solve, ReachesTheHashOfEveryOtherDevice) {
  EXPECT_EQ(hashAfter(solvedScene(), passingBall, 12, {.solveWholeNodes = 700}), 0x8238f727263d17eau);
}

}  // namespace
}  // namespace clothstream::tests
