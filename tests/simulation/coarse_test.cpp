// SPDX-License-Identifier: MIT
// Coarse correction: kernels compared with the double-precision reference, and invariants.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "server/model/coarse_level.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::Vec3;
using simulation::NodeState;

class Coarse : public GpuTest {};

// A cloth that hangs from two corners, with the damping that the correction needs.
model::Cloth hung(std::uint32_t rows, std::uint32_t columns,
                  const model::CoarseCorrection& coarse = {.cells = 4}) {
  model::Cloth cloth = calmCloth(rows, columns);
  cloth.pins = {{.firstColumn = 0, .lastColumn = columns - 1, .columnStep = columns - 1}};
  cloth.coarse = coarse;
  return cloth;
}

model::Cloth hungDisc(std::uint32_t rings, const model::CoarseCorrection& coarse = {.cells = 4}) {
  model::Cloth cloth = discCloth(rings);
  cloth.name = "disc";
  cloth.pinnedVertices = {0, 1};
  cloth.coarse = coarse;
  return cloth;
}

// One substep of both from a random state that is stretched to 1.2 times its size, so that every link acts.
void expectCorrectedLikeReference(model::Scene scene, unsigned seed,
                                  const std::vector<simulation::MovingCollider>& colliders = {}) {
  scene.substeps = 1;
  scene.simulationRate = 720;
  std::mt19937 random(seed);
  NodeState start = randomState(scene, random, 0.002f, 0.5f);
  const auto pinned = [&](std::size_t node) { return start.velocities[node] == Vec3::Zero(); };
  for (std::size_t node = 0; node < start.positions.size(); ++node)
    if (!pinned(node)) start.positions[node] *= 1.2f;
  const simulation::TickInputs inputs = inputsOf(scene, colliders);
  const auto referenceAfter = [&](const model::Scene& of) {
    reference::ReferenceSimulation reference(of);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));
    return reference;
  };
  Running running(scene);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputs).healthy);
  const NodeState state = running.state();

  // Means of at most 300 nodes lie within a metre of the origin. Their sums of two times 15 terms, and the
  // corrections of at most eight links in each sweep, round by 2^-24 of a metre each. A velocity is a way
  // over the substep.
  std::uint32_t sweeps = 0;
  for (const model::Cloth& cloth : scene.cloths)
    if (cloth.coarse) sweeps = std::max(sweeps, cloth.coarse->sweeps);
  const double tolerance = (30 + 8 * sweeps) * kRounding + 1e-6;
  const reference::ReferenceSimulation expected = referenceAfter(scene);
  EXPECT_LT(largestDistance(state, expected), tolerance);
  EXPECT_LT(largestSpeedDifference(state, expected), 720 * tolerance);

  // The comparison would detect another sweep, and no correction at all.
  model::Scene other = scene;
  for (model::Cloth& cloth : other.cloths)
    if (cloth.coarse) ++cloth.coarse->sweeps;
  EXPECT_GT(largestDistance(state, referenceAfter(other)), 2 * tolerance);
  for (model::Cloth& cloth : other.cloths) cloth.coarse.reset();
  EXPECT_GT(largestDistance(state, referenceAfter(other)), 100 * tolerance);
}

TEST_F(Coarse, MovesNodesAsTheReferenceOnEveryShapeOfGrid) {
  unsigned seed = 1;
  for (const auto& [rows, columns] :
       {std::pair{2u, 9u}, {9u, 3u}, {5u, 6u}, {17u, 17u}, {18u, 31u}, {33u, 20u}}) {
    SCOPED_TRACE(::testing::Message() << rows << " x " << columns);
    expectCorrectedLikeReference(sceneOf({hung(rows, columns)}), seed++);
  }
}

TEST_F(Coarse, MovesNodesAsTheReferenceWithEverySetting) {
  expectCorrectedLikeReference(sceneOf({hung(20, 23, {.cells = 2, .sweeps = 1})}), 10);
  expectCorrectedLikeReference(sceneOf({hung(33, 33, {.cells = 16, .sweeps = 6})}), 11);
  expectCorrectedLikeReference(
      sceneOf({hung(33, 30, {.cells = 16, .levels = 2}), hungDisc(9, {.levels = 2})}), 12);
}

TEST_F(Coarse, MovesMeshesAndSeveralClothsAsTheReference) {
  model::Cloth plain = calmCloth(7, 5);
  plain.name = "plain";
  expectCorrectedLikeReference(sceneOf({hungDisc(9), plain, hung(12, 9)}), 12);
}

TEST_F(Coarse, MovesNodesAsTheReferenceWithEverySolver) {
  using enum model::SolverKind;
  for (const model::SolverKind solver : {constraint, acad, xpbd, implicitEuler}) {
    SCOPED_TRACE(static_cast<int>(solver));
    model::Cloth cloth = hung(13, 15);
    cloth.solver.kind = solver;
    cloth.solver.iterations = solver == xpbd ? 1 : kSolveIterations;
    cloth.solver.tolerance = kSolveTolerance;
    model::Scene scene = sceneOf({cloth});
    scene.substeps = 1;
    scene.simulationRate = 720;
    // Still, and stretched by 5 %, which every solver handles without a jump between its cases.
    NodeState start = Running(scene).state();
    for (Vec3& place : start.positions) place *= 1.05f;
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputsOf(scene)));
    Running running(scene);
    running.restore(start);
    running.tick(inputsOf(scene));
    // Solves end at 1e-6 of a right-hand side of at most 2 cm a constraint.
    EXPECT_LT(largestDistance(running.state(), reference), 1e-5);
  }
}

// A ball inside the stretched cloth, where corrections lead through it.
TEST_F(Coarse, StopsAtCollidersAsTheReference) {
  model::Scene scene = sceneOf({hung(17, 17)});
  const Vec3 centre = restPositions(scene.cloths[0])[8 * 17 + 8] * 1.2f;
  simulation::MovingCollider ball{.shape = model::Sphere{0.05f}};
  ball.start.position = centre + Vec3(0, 0, 0.051f);
  ball.end.position = centre + Vec3(0, 0, 0.049f);
  expectCorrectedLikeReference(scene, 20, {ball});
}

// The start of each tick, and every other substep.
TEST_F(Coarse, ActsAsOftenAsItShould) {
  for (const std::uint32_t every : {1u, 3u, 64u}) {
    SCOPED_TRACE(every);
    model::Scene scene = sceneOf({hung(17, 17, {.cells = 4, .sweeps = 4, .every = every})});
    scene.substeps = 5;
    scene.simulationRate = 144;
    NodeState start = Running(scene).state();
    for (Vec3& place : start.positions) place *= 1.1f;
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    Running running(scene);
    running.restore(start);
    for (int tick = 0; tick < 2; ++tick) {
      reference.tick(referenceInputs(inputsOf(scene)));
      running.tick(inputsOf(scene));
    }
    // Ten substeps add up what one may differ by; forces of the stretched springs carry it on.
    EXPECT_LT(largestDistance(running.state(), reference), 10 * 10e-6);
  }
}

TEST_F(Coarse, LeavesCrumpledClothAlone) {
  model::Scene with = sceneOf({hung(17, 17)}), without = with;
  without.cloths[0].coarse.reset();
  NodeState start = Running(with).state();
  for (Vec3& place : start.positions) place *= 0.9f;
  const auto stateAfter = [&](const model::Scene& scene) {
    Running running(scene);
    running.restore(start);
    running.tick(inputsOf(scene));
    return running.state();
  };
  EXPECT_EQ(stateAfter(with).positions, stateAfter(without).positions);
}

// Sums of momenta over the nodes, relative to their middle.
reference::Vec3 angularMomentum(const NodeState& state) {
  reference::Vec3 middle = reference::Vec3::Zero(), sum = reference::Vec3::Zero();
  for (const Vec3& place : state.positions)
    middle += place.cast<double>() / static_cast<double>(state.positions.size());
  for (std::size_t i = 0; i < state.positions.size(); ++i)
    sum += (state.positions[i].cast<double>() - middle).cross(state.velocities[i].cast<double>());
  return sum;
}

// The velocities that a correction gives have no sum, but for roundings of 2^-24 of a metre. They have no
// moment around the middle, but for the turn of the links during the correction.
TEST_F(Coarse, KeepsMomentumAndAngularMomentumOfAFreeCloth) {
  model::Cloth cloth = hung(21, 30);
  cloth.pins.clear();
  cloth.damping = 0;
  cloth.structural.stiffness = cloth.shear.stiffness = cloth.bend.stiffness = 0;
  cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0;
  model::Scene scene = sceneOf({cloth});
  scene.environment.gravity = Vec3::Zero();
  scene.substeps = 1;
  NodeState start = Running(scene).state();
  for (Vec3& place : start.positions)
    place = Vec3(1.003f * place.x(), 1.001f * place.y(), place.z() + 0.002f * place.x());
  Running running(scene);
  running.restore(start);
  running.tick(inputsOf(scene));
  NodeState end = running.state();
  reference::Vec3 sum = reference::Vec3::Zero();
  double total = 0;
  for (const Vec3& velocity : end.velocities) {
    sum += velocity.cast<double>();
    total += double{velocity.norm()};
  }
  EXPECT_GT(total, 1);
  EXPECT_LT(sum.norm(), 1e-3 * total);
  end.positions = start.positions;  // where the correction acted
  EXPECT_LT(angularMomentum(end).norm(), 1e-3 * total);
}

// A sheet of 200 g that swings down from two corners, with springs as stiff as four substeps can bear.
model::Scene sheet(bool coarse) {
  model::Cloth cloth = hung(32, 32, {.cells = 4, .sweeps = 4, .every = 2});
  if (!coarse) cloth.coarse.reset();
  cloth.grid.width = cloth.grid.height = 1;
  cloth.grid.pose.orientation = turned(90, Vec3::UnitX());
  cloth.mass = 0.2f;
  cloth.damping = 1;
  model::Scene scene = sceneOf({cloth});
  scene.simulationRate = scene.streamRate = 60;
  scene.substeps = 4;
  const double h = scene.substepSeconds();
  const auto bearable = static_cast<float>(double{cloth.nodeMass()} / (h * h));
  model::Cloth& stiff = scene.cloths[0];
  stiff.structural = {0.28f * bearable,
                      1.001f * model::kCoarseDamping * cloth.nodeMass() / static_cast<float>(h)};
  stiff.shear = {0.08f * bearable, 0};
  stiff.bend = {0.04f * bearable, 0};
  return scene;
}

// Energy of 0.002 J: the whole sheet at 0.14 m/s. A frame of free fall makes it 0.16 m/s fast, two
// corrections 0.08.
TEST_F(Coarse, HoldsAFallingSheetWithFewSubstepsAndHangsCalm) {
  const auto strained = [](const model::Scene& scene, int seconds) {
    Running running(scene);
    for (int tick = 0; tick < 60 * seconds; ++tick) running.tick(inputsOf(scene));
    const NodeState state = running.state();
    double energy = 0;
    for (const Vec3& velocity : state.velocities)
      energy += 0.5 * double{scene.cloths[0].nodeMass()} * double{velocity.squaredNorm()};
    return std::pair(strainOf(scene, state), energy);
  };
  EXPECT_GT(strained(sheet(false), 3).first.mean, 0.05);
  const auto [strain, energy] = strained(sheet(true), 10);
  EXPECT_LT(strain.mean, 0.008);
  EXPECT_LT(strain.p99, 0.05);
  EXPECT_LT(energy, 0.002);
}

// A ball at 5 m/s, from one second on.
simulation::TickInputs fastBall(const model::Scene& scene, int tick) {
  const auto at = [](int t) {
    model::Pose pose;
    pose.position = Vec3(0, -0.5f, std::clamp(static_cast<float>(t - 60) * 5 / 60 - 1, -1.0f, 0.4f));
    return pose;
  };
  return inputsOf(scene, {{.shape = model::Sphere{0.2f}, .start = at(tick), .end = at(tick + 1)}});
}

TEST_F(Coarse, IsStableWithAFastBall) {
  const model::Scene scene = sheet(true);
  Running running(scene);
  for (int tick = 0; tick < 180; ++tick) ASSERT_TRUE(running.tick(fastBall(scene, tick)).healthy);
  EXPECT_LT(strainOf(scene, running.state()).mean, 0.06);
}

TEST_F(Coarse, HasTheSameBitsHoweverTheWorkIsDivided) {
  const model::Scene scene = sceneOf({hung(21, 37), hungDisc(8)});
  expectSameBits(scene, passingBall, 20,
                 std::vector<simulation::SimulationOptions>{
                     {}, {.workgroupSize = 32}, {.workgroupSize = 128}, {.rowsPerInvocation = 1}});
}

// Springs, mass and thickness change, and the correction goes on with the new ones.
TEST_F(Coarse, GoesOnAfterAChangeAsAlways) {
  const model::Scene scene = sceneOf({hung(21, 37), hungDisc(8)});
  model::Scene changed = scene;
  for (model::Cloth& cloth : changed.cloths) {
    cloth.mass *= 1.3f;
    cloth.structural.stiffness *= 1.1f;
    cloth.thickness = 0.02f;
  }
  Running running(scene);
  for (int tick = 0; tick < 10; ++tick) running.tick(passingBall(scene, tick));
  expectGoesOnAsAlways(running, changed, passingBall(scene, 10), 10);
}

// Attachments, tethers and self-collision.
TEST_F(Coarse, HasTheSameBitsTogetherWithEverythingElse) {
  model::Scene scene = sceneOf({hung(21, 21), hungDisc(8)});
  model::Cloth& cloth = scene.cloths[0];
  cloth.pins.clear();
  model::Attachment& rod = cloth.attachments.emplace_back();
  rod.name = "rod";
  rod.ranges = {topRow(cloth)};
  rod.motion.keys = {{0, Vec3::Zero()}, {1, Vec3(0.2f, 0, 0.1f)}};
  for (model::Cloth& each : scene.cloths) {
    each.tethers = model::Tethers{};
    each.selfCollision = model::SelfCollision{.radius = 0.01f};
  }
  expectSameBits(
      scene, passingBall, 20,
      std::vector<simulation::SimulationOptions>{{}, {.workgroupSize = 32}, {.rowsPerInvocation = 1}});
}

// Recorded on lavapipe with vectors of 256 bits.
TEST_F(Coarse, ReachesTheHashOfEveryOtherDevice) {
  EXPECT_EQ(hashAfter(sceneOf({hung(21, 37, {.cells = 8, .levels = 2}), hungDisc(8)}), passingBall, 100),
            0x8ff9567f42bafb06u);
}

}  // namespace
}  // namespace clothstream::tests
