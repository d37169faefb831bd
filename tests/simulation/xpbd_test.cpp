// SPDX-License-Identifier: MIT
// Extended position-based dynamics: kernels compared with the double-precision reference, and invariants.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "server/model/springs.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;

class Xpbd : public GpuTest {};

model::Cloth corrected(model::Cloth cloth, std::uint32_t iterations = 1) {
  cloth.solver.kind = model::SolverKind::xpbd;
  cloth.solver.iterations = iterations;
  return cloth;
}

model::Cloth grid(std::uint32_t rows, std::uint32_t columns, std::uint32_t iterations = 1) {
  model::Cloth cloth = corrected(calmCloth(rows, columns), iterations);
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = columns - 1, .columnStep = 2}};
  return cloth;
}

model::Cloth mesh(std::uint32_t rings, std::uint32_t iterations = 1) {
  model::Cloth cloth = corrected(discCloth(rings), iterations);
  cloth.name = "mesh";
  cloth.pinnedVertices = {0, 1};
  return cloth;
}

// size x size nodes, a metre of cloth of 0.2 kg, hung by one edge; upright, or swinging down from horizontal.
model::Scene sheet(std::uint32_t size, std::uint32_t substeps, bool upright) {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = size, .columns = size, .width = 1, .height = 1, .pose = {}};
  if (!upright) cloth.grid.pose.orientation = turned(90, model::Vec3::UnitX());
  cloth.mass = 0.2f;
  cloth.pins = {topRow(cloth)};
  cloth.solver.compliance = 0.0f;
  model::Scene scene = sceneOf({corrected(cloth)});
  scene.substeps = substeps;
  return scene;
}

void expectCorrectedLikeReference(model::Scene scene, unsigned seed,
                                  simulation::SimulationOptions options = {}) {
  scene.substeps = 1;
  scene.simulationRate = 720;
  // Far beyond the stability of spring forces. A sweep then corrects a large part of each error.
  for (model::Cloth& cloth : scene.cloths)
    for (model::Spring* spring : {&cloth.structural, &cloth.shear, &cloth.bend}) spring->stiffness *= 30;
  std::mt19937 random(seed);
  const NodeState start = randomState(scene, random, 0.002f, 0.5f);
  const auto referenceAfter = [&](const model::Scene& of) {
    reference::ReferenceSimulation reference(of);
    setState(reference, start);
    reference.tick(referenceInputs(inputsOf(of)));
    return reference;
  };
  Running running(scene, options);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputsOf(scene)).healthy);
  const NodeState state = running.state();
  const reference::ReferenceSimulation expected = referenceAfter(scene);

  // A correction rounds each end to half of 2^-24 of at most half a metre on each axis, 2.6e-8 m in all. It
  // computes a length of at most 0.04 m from such ends with a relative error of 1e-6: less than 1e-7 m in
  // all. A sweep corrects a node of a grid twelve times, of the disc fifteen times. It reduces the errors
  // that it finds at the neighbours.
  std::uint32_t iterations = 0;
  for (const model::Cloth& cloth : scene.cloths) iterations = std::max(iterations, cloth.solver.iterations);
  const double tolerance = iterations * 15 * 1e-7;
  EXPECT_LT(largestDistance(state, expected), tolerance);
  EXPECT_LT(largestSpeedDifference(state, expected), 720 * tolerance);

  // The comparison would detect one more sweep, or slightly less stiffness.
  model::Scene other = scene;
  for (model::Cloth& cloth : other.cloths) ++cloth.solver.iterations;
  EXPECT_GT(largestDistance(state, referenceAfter(other)), 2 * tolerance);
  other = scene;
  for (model::Cloth& cloth : other.cloths) {
    cloth.structural.stiffness *= 0.8f;
    if (cloth.solver.compliance) *cloth.solver.compliance += 0.002f;
  }
  EXPECT_GT(largestDistance(state, referenceAfter(other)), 2 * tolerance);
}

TEST_F(Xpbd, MovesNodesAsTheReferenceOnEveryShapeOfGrid) {
  unsigned seed = 1;
  for (const auto& [rows, columns] :
       {std::pair{2u, 2u}, {2u, 7u}, {9u, 3u}, {4u, 4u}, {5u, 6u}, {7u, 8u}, {17u, 23u}}) {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns);
    expectCorrectedLikeReference(sceneOf({grid(rows, columns)}), seed++);
  }
}

TEST_F(Xpbd, MovesNodesAsTheReferenceInParts) {
  expectCorrectedLikeReference(sceneOf({grid(17, 23)}), 8, {.xpbdWholeNodes = 0});
  expectCorrectedLikeReference(sceneOf({mesh(7)}), 9, {.xpbdWholeNodes = 0});
}

TEST_F(Xpbd, MovesNodesAsTheReferenceInSeveralSweeps) {
  expectCorrectedLikeReference(sceneOf({grid(9, 14, 3)}), 10);
  expectCorrectedLikeReference(sceneOf({mesh(5, 3)}), 11);
}

TEST_F(Xpbd, MovesMeshesAsTheReference) {
  expectCorrectedLikeReference(sceneOf({mesh(7), grid(6, 9)}), 12);
}

TEST_F(Xpbd, MovesNodesAsTheReferenceWithoutDashpotsOrBendSprings) {
  model::Cloth cloth = grid(11, 9);
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  expectCorrectedLikeReference(sceneOf({cloth}), 13);
  cloth.bend.stiffness = 0;
  expectCorrectedLikeReference(sceneOf({cloth}), 14);
}

TEST_F(Xpbd, MovesNodesAsTheReferenceWithACompliance) {
  for (const float compliance : {0.0f, 0.001f}) {
    model::Cloth cloth = grid(11, 9, 2);
    cloth.solver.compliance = compliance;
    expectCorrectedLikeReference(sceneOf({cloth}), 15);
  }
}

TEST_F(Xpbd, AirMovesNodesAsInTheReference) {
  model::Cloth cloth = grid(9, 10);
  cloth.drag = 0.8f;
  cloth.lift = 0.5f;
  model::Scene scene = sceneOf({cloth});
  scene.environment.wind = model::Vec3(2, 0, 5);
  expectCorrectedLikeReference(scene, 16);
}

// A chain hangs still if a substep's corrections undo exactly the motion by gravity. The spring below n nodes
// then gives h^2 times its force n m g, for every order of the sweep. Right after its correction it is n m g
// / k too long. The later corrections move each of its ends by at most h^2 / m times the largest force.
TEST_F(Xpbd, StretchesAHangingColumnAsItsStiffnessRequires) {
  constexpr std::uint32_t kNodes = 12;
  model::Cloth cloth = corrected(calmCloth(kNodes, 2));
  cloth.structural = {200, 0};
  cloth.shear = cloth.bend = {};
  cloth.damping = 20;
  cloth.pins = {topRow(cloth)};
  model::Scene scene = sceneOf({cloth});
  scene.substeps = 40;
  Running running(scene);
  for (const float stiffness : {200.0f, 400.0f}) {
    cloth.structural.stiffness = stiffness;
    running.setCloths(std::vector{cloth});
    for (int tick = 0; tick < 108; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
    const NodeState state = running.state();
    const double h = scene.substepSeconds(), g = double{9.81f}, mass = 0.01;
    const double tolerance = 2 * h * h * (kNodes - 1) * g + 20 * kRounding;
    EXPECT_LT(tolerance, 0.02 * (kNodes - 1) * mass * g / double{stiffness});
    for (std::uint32_t row = 0; row + 1 < kNodes; ++row) {
      const double length = double{(state.positions[2 * row + 2] - state.positions[2 * row]).norm()};
      EXPECT_NEAR(length - 0.02, (kNodes - 1 - row) * mass * g / double{stiffness}, tolerance) << row;
    }
  }
}

reference::Vec3 sumOf(const std::vector<model::Vec3>& vectors) {
  reference::Vec3 sum = reference::Vec3::Zero();
  for (const model::Vec3& v : vectors) sum += v.cast<double>();
  return sum;
}

// A correction gives both ends the same momentum, but for the rounding of their positions: each to within
// half of 2^-24 of the cloth's 0.4 m, which h makes a speed. Roundings are independent; six of their standard
// deviations.
TEST_F(Xpbd, KeepsAFreeClothsMomentum) {
  model::Cloth cloth = corrected(calmCloth(20, 20));
  cloth.damping = 0;
  model::Scene scene = sceneOf({cloth});
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(7);
  const NodeState start = randomState(scene, random, 0.001f, 0.5f);
  Running running(scene);
  running.restore(start);
  constexpr int kTicks = 20;
  for (int tick = 0; tick < kTicks; ++tick) running.tick(inputsOf(scene));
  const double roundings = 400.0 * kTicks * 10 * 12;
  const double rounding = 0.4 * kRounding * 720 / std::sqrt(3.0);
  const NodeState end = running.state();
  EXPECT_LT((sumOf(end.velocities) - sumOf(start.velocities)).cwiseAbs().maxCoeff(),
            6 * std::sqrt(roundings) * rounding);
  // The cloth has moved.
  double change = 0;
  for (std::size_t i = 0; i < end.velocities.size(); ++i)
    change += double{(end.velocities[i] - start.velocities[i]).norm()};
  EXPECT_GT(change, 10);
}

// Velocities are not computed from rounded positions. Without corrections a cloth falls as gravity says, for
// every length of the substep.
TEST_F(Xpbd, FallsExactlyWithoutStretch) {
  model::Cloth cloth = corrected(calmCloth(8, 8));
  cloth.damping = 0;
  cloth.grid.pose.position = model::Vec3(3, 5, 1);
  model::Scene scene = sceneOf({cloth});
  scene.substeps = 200;
  Running running(scene);
  for (int tick = 0; tick < 36; ++tick) running.tick(inputsOf(scene));
  // Springs see the rounding of their ends' places, 5 m from the origin: they shift momentum between nodes,
  // and their sum stays.
  const reference::Vec3 mean = sumOf(running.state().velocities) / 64;
  EXPECT_NEAR(mean.y(), -9.81 * 0.5, 0.001 * 9.81 * 0.5);
}

TEST_F(Xpbd, KeepsPinnedNodesInPlace) {
  const model::Scene scene = sceneOf({grid(9, 14), mesh(4)});
  const simulation::MovingCollider ball{
      model::Sphere{0.1f}, {model::Vec3(0, -0.05f, 0)}, {model::Vec3(0, -0.05f, 0)}, 1};
  Running running(scene);
  for (int tick = 0; tick < 30; ++tick) running.tick(inputsOf(scene, {ball}));
  const NodeState rest = simulation::restState(scene.cloths), state = running.state();
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  for (std::size_t i = 0; i < masses.size(); ++i) {
    if (masses[i] > 0) continue;
    EXPECT_EQ(state.positions[i], rest.positions[i]) << i;
    EXPECT_EQ(state.velocities[i], model::Vec3(0, 0, 0)) << i;
  }
}

// The excess length of a hard spring comes from its neighbours, which are corrected after it: h^2 / m times
// their forces. A row carries at most 32 m g per column. With h = 1/720 s one such pull is 6e-4 m of 0.032
// m, 1.9 %. The two springs at the ends of a column have two such pulls. The length of the substep decides:
// four times as many substeps leave a sixteenth.
TEST_F(Xpbd, StretchesHardSpringsInProportionToTheSubstep) {
  std::vector<double> strains;
  for (const std::uint32_t substeps : {10u, 40u}) {
    model::Scene scene = sheet(32, substeps, true);
    scene.cloths.front().damping = 4;
    scene.cloths.front().structural = scene.cloths.front().shear = {100, 0};
    Running running(scene);
    for (int tick = 0; tick < 180; ++tick) running.tick(inputsOf(scene));
    strains.push_back(strainOf(scene, running.state()).max);
  }
  RecordProperty("strain10", std::to_string(strains[0]));
  RecordProperty("strain40", std::to_string(strains[1]));
  EXPECT_LT(strains[0], 0.04);
  EXPECT_LT(strains[1], strains[0] / 10);
}

TEST_F(Xpbd, LeavesNoNodeInsideASphere) {
  const model::Scene scene = sheet(24, 20, false);
  const model::Pose place{model::Vec3(0, -0.3f, -0.3f)};
  const simulation::MovingCollider ball{model::Sphere{0.2f}, place, place, 1};
  Running running(scene);
  for (int tick = 0; tick < 72; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene, {ball})).healthy);
  const double distance = 0.2 + double{scene.cloths.front().thickness};
  double nearest = 1;
  const NodeState state = running.state();
  const std::vector<float> masses = simulation::inverseMasses(scene.cloths);
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (masses[i] > 0)
      nearest = std::min(nearest, (state.positions[i] - ball.start.position).cast<double>().norm());
  EXPECT_GT(nearest, distance * (1 - 1e-5));
  EXPECT_LT(nearest, distance * 1.01);  // the sheet does touch the sphere
}

// A cloth of each solver, a mesh, several sweeps, a ball.
model::Scene mixedScene() {
  model::Cloth free = calmCloth(9, 14);
  free.name = "free";
  free.pins = {topRow(free)};
  model::Cloth held = free, adaptive = free;
  held.name = "held";
  held.solver.kind = model::SolverKind::constraint;
  adaptive.name = "adaptive";
  adaptive.solver.kind = model::SolverKind::acad;
  model::Cloth swept = grid(13, 11, 3);
  swept.name = "swept";
  swept.drag = 0.5f;
  model::Scene scene = sceneOf({held, grid(19, 16), free, mesh(6), adaptive, swept, mesh(3, 2)});
  scene.cloths[1].solver.compliance = 0.0f;
  scene.cloths.back().name = "small";
  scene.environment.wind = model::Vec3(0, 0, 2);
  return scene;
}

// Omits the solvers that use conjugate gradients; other tests cover these.
void eraseSystems(model::Scene& scene) {
  std::erase_if(scene.cloths, [](const model::Cloth& cloth) {
    return cloth.solver.kind == model::SolverKind::constraint || cloth.solver.kind == model::SolverKind::acad;
  });
}

TEST_F(Xpbd, GivesTheSameBitsForEveryPartitionOfWork) {
  model::Scene scene = mixedScene();
  eraseSystems(scene);
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 0, .xpbdWholeNodes = 0},
                                                {.workgroupSize = 0, .xpbdWholeNodes = 150},
                                                {.workgroupSize = 0, .xpbdWholeNodes = 1'000'000},
                                                {.workgroupSize = 32, .xpbdWholeNodes = 0},
                                                {.workgroupSize = 128, .xpbdWholeNodes = 1'000'000}};
  expectSameBits(scene, passingBall, 12, ways);
}

TEST_F(Xpbd, GivesTheSameHashesInLongRuns) {
  model::Scene scene = mixedScene();
  eraseSystems(scene);
  scene.substeps = 3;
  for (model::Cloth& cloth : scene.cloths) cloth.structural.stiffness = cloth.shear.stiffness = 60;
  expectSameLongRuns(scene, passingBall, {.workgroupSize = 16, .xpbdWholeNodes = 0});
}

// The hash is the same on every device.
TEST_F(Xpbd, ReachesTheHashOfEveryOtherDevice) {
  model::Scene scene = mixedScene();
  eraseSystems(scene);
  EXPECT_EQ(hashAfter(scene, passingBall, 60), 0x54f140c2644e8357u);
}

TEST_F(Xpbd, DoesNotChangeClothsOfOtherSolvers) {
  const model::Scene together = mixedScene();
  model::Scene alone = together;
  std::erase_if(alone.cloths, [](const model::Cloth& c) { return c.solver.kind == model::SolverKind::xpbd; });
  Running one(alone), both(together);
  for (int tick = 0; tick < 20; ++tick) {
    one.tick(passingBall(alone, tick));
    both.tick(passingBall(together, tick));
  }
  const NodeState expected = one.state(), found = both.state();
  const std::vector<std::uint32_t> offsets = simulation::clothOffsets(together.cloths);
  std::size_t node = 0;
  for (std::size_t i = 0; i < together.cloths.size(); ++i) {
    if (together.cloths[i].solver.kind == model::SolverKind::xpbd) continue;
    for (std::uint32_t k = offsets[i]; k < offsets[i + 1]; ++k, ++node)
      ASSERT_EQ(expected.positions[node], found.positions[k]) << together.cloths[i].name << " " << k;
  }
  EXPECT_EQ(node, expected.positions.size());
}

}  // namespace
}  // namespace clothstream::tests
