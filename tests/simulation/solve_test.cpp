// SPDX-License-Identifier: MIT
// Linear systems on the device: the same bits for every partition of the work.
#include <cmath>
#include <memory>
#include <numbers>
#include <stdexcept>
#include <string>
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

// A wheel: `spokes` nodes in each ring around a hub, which has a spring to each node of the first ring.
model::Cloth wheel(std::uint32_t spokes, std::uint32_t rings) {
  model::MeshShape shape;
  shape.positions.emplace_back(0, 0, 0);
  for (std::uint32_t ring = 1; ring <= rings; ++ring)
    for (std::uint32_t spoke = 0; spoke < spokes; ++spoke) {
      const double angle = 2 * std::numbers::pi * spoke / spokes, radius = 0.4 + 0.02 * ring;
      shape.positions.emplace_back(static_cast<float>(radius * std::cos(angle)), 0,
                                   static_cast<float>(radius * std::sin(angle)));
    }
  for (std::uint32_t ring = 0; ring < rings; ++ring)
    for (std::uint32_t spoke = 0; spoke < spokes; ++spoke) {
      const std::uint32_t next = (spoke + 1) % spokes, inner = 1 + (ring - 1) * spokes,
                          outer = 1 + ring * spokes;
      if (ring == 0) {
        shape.triangles.push_back({0, outer + next, outer + spoke});
        continue;
      }
      shape.triangles.push_back({inner + spoke, inner + next, outer + spoke});
      shape.triangles.push_back({inner + next, outer + next, outer + spoke});
    }
  shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
  model::Cloth cloth = calmCloth(2, 2);
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(std::move(shape)));
  cloth.mass = 0.02f * static_cast<float>(cloth.nodeCount());
  cloth.pinnedVertices = {1};
  return cloth;
}

// One iteration of one workgroup would be more loop rounds than lavapipe runs. It would then end its loops
// early, without an error.
TEST_F(Solve, GivesTheSameBitsIfManySpringsMeetAtAVertex) {
  model::Scene scene = sceneOf({named("wheel", wheel(124, 33), model::SolverKind::constraint)});
  ASSERT_GT(scene.nodeCount(), 4'000u);
  ASSERT_LE(scene.nodeCount(), 4'096u);
  scene.substeps = 1;
  scene.simulationRate = 720;
  scene.cloths[0].solver.iterations = 60;
  scene.cloths[0].solver.tolerance = 0;
  const auto inputs = [](const model::Scene& of, int) { return inputsOf(of); };
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 8, .solveWholeNodes = 4'096},
                                                {.workgroupSize = 8, .solveWholeNodes = 0}};
  expectSameBits(scene, inputs, 1, ways);
}

// The same for a chunk: no partition is small enough.
TEST_F(Solve, RefusesAVertexWithMoreSpringsThanTheDeviceHasLoopRounds) {
  if (!device().isSoftware()) GTEST_SKIP() << "only software devices limit the loop rounds";
  const model::Scene scene = sceneOf({named("fan", wheel(5'000, 1), model::SolverKind::constraint)});
  try {
    const Running running(scene);
    FAIL() << "accepted";
  } catch (const std::runtime_error& refused) {
    EXPECT_NE(std::string(refused.what()).find("cloth 'fan'"), std::string::npos) << refused.what();
  }
}

// The hash is the same on every device.
TEST_F(Solve, ReachesTheHashOfEveryOtherDevice) {
  EXPECT_EQ(hashAfter(solvedScene(), passingBall, 12, {.solveWholeNodes = 700}), 0x531d89c97e7cc83au);
}

}  // namespace
}  // namespace clothstream::tests
