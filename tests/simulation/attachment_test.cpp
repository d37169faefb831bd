// SPDX-License-Identifier: MIT
// Attachments, tethers and grabs.
#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/model/tethers.h"
#include "server/simulation/attachment/grabbed_nodes.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::Vec3;
using simulation::Grab;
using simulation::NodeState;

class Attachments : public GpuTest {};

model::Attachment leftColumn(const model::Cloth& cloth) {
  model::Attachment attachment;
  attachment.name = "rod";
  attachment.ranges = {{.firstRow = 0, .lastRow = cloth.grid.rows - 1}};
  return attachment;
}

model::Pose moved(const Vec3& by, float degrees = 0, const Vec3& axis = Vec3::UnitY()) {
  return {by, turned(degrees, axis)};
}

Grab taking(const Vec3& at, float radius) {
  return {.state = Grab::State::takes, .start = moved(at), .end = moved(at), .radius = radius};
}

// Takes the point between these nodes of a scene.
Grab takingPlace(const Vec3& hand, float radius, const std::array<std::uint32_t, 3>& nodes) {
  Grab grab = taking(hand, radius);
  grab.place = {.nodes = nodes, .weights = {0.5f, 0.3f, 0.2f}};
  grab.leftAtStart = 1;
  grab.leftAtEnd = 0.99f;
  return grab;
}

// The same grab, which moves to another place in the next tick.
Grab onTheWay(const Grab& grab, const Vec3& to) {
  Grab next = grab;
  next.state = Grab::State::holds;
  next.start = grab.end;
  next.end.position = to;
  return next;
}

// A cloth without springs, damping and gravity.
model::Scene dust(std::uint32_t rows, std::uint32_t columns) {
  model::Scene scene = sceneOf({calmCloth(rows, columns)});
  model::Cloth& cloth = scene.cloths[0];
  cloth.structural = cloth.shear = cloth.bend = {};
  cloth.damping = 0;
  scene.environment.gravity = Vec3::Zero();
  return scene;
}

// One substep of both from a random state, with everything that holds. Places of what is held are wrong by
// some roundings of where they are, which velocities feel over a substep; the rest is what kernels_test.cpp
// allows a spring's force. Slipping and being near enough are yes or no: no node of these states is within
// those roundings of either.
TEST_F(Attachments, MatchTheReferenceWithEverySolver) {
  using enum model::SolverKind;
  unsigned seed = 1;
  for (const model::SolverKind solver : {massSpring, constraint, acad, xpbd, implicitEuler}) {
    SCOPED_TRACE(static_cast<int>(solver));
    model::Scene scene = sceneOf({calmCloth(13, 17), discCloth(5)});
    scene.substeps = 1;
    scene.simulationRate = 720;
    scene.cloths[1].name = "disc";
    scene.cloths[0].attachments = {leftColumn(scene.cloths[0])};
    scene.cloths[0].tethers = model::Tethers{.slack = 0};
    for (model::Cloth& cloth : scene.cloths) {
      cloth.solver.kind = solver;
      cloth.solver.iterations = solver == xpbd ? 1 : 400;
      cloth.solver.tolerance = 1e-6f;
    }
    simulation::TickInputs inputs = inputsOf(scene);
    inputs.attachments = {moved(Vec3(0.003f, 0.001f, -0.002f), 1, Vec3(1, 2, 3))};
    std::mt19937 random(seed++);
    const NodeState start = randomState(scene, random, 0.002f, 0.1f);
    inputs.grabs = {taking(start.positions[100], 0.031f),
                    taking(start.positions[230] + Vec3(0, 0.02f, 0), 0.001f),
                    takingPlace(start.positions[50] + Vec3(0.1f, 0.2f, 0.3f), 0.015f, {50, 67, 51})};
    inputs.grabs[0].end = {inputs.grabs[0].start.position + Vec3(0, 0.001f, 0.002f),
                           turned(2, Vec3(3, 1, 2))};
    inputs.grabs[1].maxForce = 0.05f;

    Running running(scene);
    running.restore(start);
    EXPECT_TRUE(running.tick(inputs).healthy);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputs));
    const std::vector<simulation::GrabStatus> grabs = running.grabs();
    ASSERT_EQ(grabs.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(grabs[i].taken, reference.attachments().status()[i].taken);
      EXPECT_EQ(grabs[i].slipped, reference.attachments().status()[i].slipped);
      EXPECT_GT(grabs[i].taken, 0u);
      EXPECT_LT((grabs[i].offset.cast<double>() - reference.attachments().status()[i].offset).norm(),
                8 * kRounding * 4);
    }
    EXPECT_GT(grabs[2].offset.norm(), 0.3f);
    const double h = scene.substepSeconds(), extent = 4;
    // A constraint takes its whole error of length back in a substep: as a place does.
    const double place = 16 * kRounding * extent / h;
    const model::Spring& spring = scene.cloths[0].structural;
    const double force = 12 * kRounding * spring.stiffness * (2 * extent + 0.6);
    // Systems are solved to a millionth of the residual that they begin with, which is of the size of the
    // velocities.
    const double solved = solver == massSpring || solver == xpbd ? 0 : 1e-6 * 100;
    const double speed = place + h / 0.01 * force + solved;
    EXPECT_LT(largestSpeedDifference(running.state(), reference), speed);
    EXPECT_LT(largestDistance(running.state(), reference), h * speed + 4 * kRounding * extent);
    setState(reference, start);
    EXPECT_GT(largestSpeedDifference(running.state(), reference), 100 * speed);
  }
}

TEST_F(Attachments, KeepNodesAtTheirFrameAgainstEveryForce) {
  using enum model::SolverKind;
  for (const model::SolverKind solver : {massSpring, constraint, acad, xpbd, implicitEuler}) {
    model::Scene scene = sceneOf({calmCloth(9, 9)});
    model::Cloth& cloth = scene.cloths[0];
    cloth.attachments = {leftColumn(cloth)};
    cloth.solver.kind = solver;
    if (solver == xpbd) cloth.solver.iterations = 1;
    Running running(scene);
    const std::vector<Vec3> rest = model::restPositions(cloth);
    for (int tick = 1; tick <= 100; ++tick) {
      const float t = static_cast<float>(tick) / 72;
      const model::Pose frame = moved(Vec3(0.2f * t, 0.1f * t * t, -0.3f * t), 90 * t, Vec3(1, 1, 0));
      simulation::TickInputs inputs = inputsOf(scene);
      inputs.attachments = {frame};
      ASSERT_TRUE(running.tick(inputs).healthy);
      if (tick % 25 != 0) continue;
      const NodeState state = running.state();
      for (std::uint32_t node = 0; node < 81; node += 9) {
        const Vec3 place = frame.position + frame.orientation * rest[node];
        // Ten substeps, each rounded once at positions within a metre, and the place itself.
        EXPECT_LT((state.positions[node] - place).norm(), 20 * kRounding) << tick;
      }
    }
    // The cloth has followed.
    EXPECT_GT(running.state().positions[44].z(), -2);
    EXPECT_LT(running.state().positions[44].z(), -0.1f);
  }
}

// Two cloths of three go along, each by its own motion.
TEST_F(Attachments, CarryAlongAsTheReference) {
  model::Scene scene = sceneOf({calmCloth(5, 4), calmCloth(3, 3), discCloth(3)});
  scene.cloths[1].name = "stays";
  scene.cloths[2].name = "disc";
  scene.cloths[0].attachments = {leftColumn(scene.cloths[0])};
  scene.substeps = 1;
  scene.simulationRate = 720;
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.attachments = {moved(Vec3(2, 0.5f, -1), 130, Vec3(1, 2, 3))};
  inputs.carries = {{0, {}, inputs.attachments[0]},
                    {2, moved(Vec3(0.3f, 0, 0), 20, Vec3(0, 1, 1)), moved(Vec3(1, 2, 3), -70)}};
  std::mt19937 random(4);
  const NodeState start = randomState(scene, random, 0.002f, 0.1f);
  Running running(scene);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputs).healthy);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputs));
  // Places are rounded some ten times on their way. Springs feel that as a force, and attached nodes as a
  // speed that takes them back in the tick.
  const double h = scene.substepSeconds(), place = 10 * kRounding * kExtent;
  const double force = 12 * scene.cloths[0].structural.stiffness * 2 * place;
  const double speed = place / h + h / 0.01 * force;
  EXPECT_LT(largestSpeedDifference(running.state(), reference), speed);
  EXPECT_LT(largestDistance(running.state(), reference), place + h * speed);
  EXPECT_GT((running.state().positions[7] - start.positions[7]).norm(), 1);
}

TEST_F(Attachments, FollowAJumpingFrameAtThirtyMetresPerSecond) {
  model::Scene scene = dust(3, 3);
  scene.cloths[0].attachments = {leftColumn(scene.cloths[0])};
  Running running(scene);
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.attachments = {moved(Vec3(1, 0, 0))};
  running.tick(inputs);
  const float step = 30.0f / 72, first = model::restPositions(scene.cloths[0])[0].x();
  EXPECT_NEAR(running.state().positions[0].x(), first + step, 1e-5);
  for (int tick = 0; tick < 2; ++tick) running.tick(inputs);
  EXPECT_NEAR(running.state().positions[0].x(), first + 1, 1e-6);
  running.tick(inputs);
  EXPECT_NEAR(running.state().velocities[0].norm(), 0, 1e-4);
}

// The cloth hangs by two corners and has springs that are too weak to hold it. No node gets farther from
// either corner than the distance along the cloth.
TEST_F(Attachments, TethersLimitTheStretchOfWeakSprings) {
  const auto farthestOf = [](bool tethered, std::size_t which) {
    model::Cloth cloth = calmCloth(17, 17);
    cloth.structural.stiffness = cloth.shear.stiffness = 2;
    cloth.bend.stiffness = 0;
    cloth.pins = {{}, {.firstColumn = 16, .lastColumn = 16}};
    if (tethered) cloth.tethers = model::Tethers{.slack = 0.05f};
    const model::Scene scene = sceneOf({cloth});
    const std::vector<model::NodeTethers> tethers = model::nodeTethers(cloth);
    Running running(scene);
    double farthest = 0;
    for (int tick = 0; tick < 144; ++tick) running.tick(inputsOf(scene));
    const NodeState state = running.state();
    for (std::size_t node = 0; node < tethers.size(); ++node) {
      const model::Tether& tether = tethers[node][which];
      if (tether.anchor != model::Tether::kNone)
        farthest =
            std::max(farthest, double{(state.positions[node] - state.positions[tether.anchor]).norm()} /
                                   double{tether.length});
    }
    return farthest;
  };
  EXPECT_LT(farthestOf(true, 0), 1.05 + 1e-5);
  // The shorter tether may pull beyond the other's end again.
  EXPECT_LT(farthestOf(true, 1), 1.06);
  EXPECT_GT(farthestOf(false, 0), 1.5);
}

TEST_F(Attachments, GrabsTakeNodesWithinRadiusOrTheNearestWithinReach) {
  const model::Scene scene = dust(9, 9);  // 2 cm apart
  const std::vector<Vec3> rest = model::restPositions(scene.cloths[0]);
  const auto taken = [&](const Grab& grab) {
    Running running(scene);
    simulation::TickInputs inputs = inputsOf(scene);
    inputs.grabs = {grab};
    running.tick(inputs);
    return running.grabs()[0].taken;
  };
  EXPECT_EQ(taken(taking(rest[40], 0.001f)), 1u);
  EXPECT_EQ(taken(taking(rest[40], 0.021f)), 5u);
  EXPECT_EQ(taken(taking(rest[40], 0.029f)), 9u);
  EXPECT_EQ(taken(taking(rest[40] + Vec3(0, 0, 0.09f), 0.03f)), 1u);
  EXPECT_EQ(taken(taking(rest[40] + Vec3(0, 0, 0.11f), 0.03f)), 0u);
}

TEST_F(Attachments, GrabsTakeTheirPlaceWhereverItIs) {
  model::Scene scene = dust(9, 9);  // 2 cm apart
  const std::vector<Vec3> rest = model::restPositions(scene.cloths[0]);
  const std::array<std::uint32_t, 3> corners{40, 49, 41};
  const Vec3 point = 0.5f * rest[40] + 0.3f * rest[49] + 0.2f * rest[41];
  const auto taken = [&](const Grab& grab) {
    Running running(scene);
    simulation::TickInputs inputs = inputsOf(scene);
    inputs.grabs = {grab};
    running.tick(inputs);
    return running.grabs()[0];
  };
  const Vec3 hand = point + Vec3(3, -2, 1);
  // The nearest node of the triangle, if none is within the radius.
  EXPECT_EQ(taken(takingPlace(hand, 0.001f, corners)).taken, 1u);
  EXPECT_EQ(taken(takingPlace(hand, 0.019f, corners)).taken, 3u);
  EXPECT_LT((taken(takingPlace(hand, 0.001f, corners)).offset - (point - hand)).norm(), 4 * kRounding * 4);
  // Nothing is within reach of a place whose nodes are all pinned, although other nodes are near the hand.
  scene.cloths[0].pins = {{.firstRow = 4, .lastRow = 5, .firstColumn = 4, .lastColumn = 5}};
  EXPECT_EQ(taken(takingPlace(rest[0], 0.001f, corners)).taken, 0u);
}

TEST_F(Attachments, AGrabDrawsItsPlaceToTheHandAndLetsNothingSlipMeanwhile) {
  const model::Scene scene = dust(9, 9);
  const std::vector<Vec3> rest = model::restPositions(scene.cloths[0]);
  Running running(scene);
  simulation::TickInputs inputs = inputsOf(scene);
  const Vec3 hand = rest[40] + Vec3(0, 0, 0.5f);
  constexpr int kTicks = 10;
  const auto left = [](int ticks) { return std::max(0.0f, 1 - static_cast<float>(ticks) / kTicks); };
  inputs.grabs = {takingPlace(hand, 0.001f, {40, 49, 41})};
  inputs.grabs[0].place->weights = {1, 0, 0};
  for (int tick = 0; tick < 20; ++tick) {
    inputs.grabs[0].leftAtStart = left(tick);
    inputs.grabs[0].leftAtEnd = left(tick + 1);
    running.tick(inputs);
    EXPECT_EQ(running.grabs()[0].slipped, 0u) << tick;
    const Vec3 place = hand + left(tick + 1) * (rest[40] - hand);
    // The node starts at rest and follows with a correction of a quarter a substep: at first it lags by a
    // substep's way times four.
    EXPECT_LT((running.state().positions[40] - place).norm(), 4 * 0.5 / kTicks / scene.substeps + 1e-3)
        << tick;
    inputs.grabs = {onTheWay(inputs.grabs[0], hand)};
  }
  EXPECT_LT((running.state().positions[40] - hand).norm(), 1e-4);
}

TEST_F(Attachments, GrabbedNodesFollowTheHand) {
  model::Scene scene = sceneOf({calmCloth(9, 9)});
  const std::vector<Vec3> rest = model::restPositions(scene.cloths[0]);
  Running running(scene);
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.grabs = {taking(rest[40], 0.03f)};
  inputs.grabs[0].maxForce = 1000;
  running.tick(inputs);
  for (int tick = 1; tick <= 72; ++tick) {
    inputs.grabs = {onTheWay(inputs.grabs[0], rest[40] + Vec3(0.005f, 0.01f, 0) * static_cast<float>(tick))};
    inputs.grabs[0].end.orientation = turned(static_cast<float>(tick), Vec3::UnitZ());
    ASSERT_TRUE(running.tick(inputs).healthy);
  }
  const NodeState state = running.state();
  const model::Pose& hand = inputs.grabs[0].end;
  for (const std::uint32_t node : {30u, 31u, 32u, 39u, 40u, 41u, 48u, 49u, 50u}) {
    const Vec3 place = hand.position + hand.orientation * (rest[node] - rest[40]);
    // A substep's fall, h^2 (g + forces / m), is taken back by a quarter each: some four of them are left,
    // with the 80 N/kg that the springs of a hanging cloth of 81 nodes may pull with.
    EXPECT_LT((state.positions[node] - place).norm(), 4 * 100 / 720.0 / 720.0) << node;
  }
  EXPECT_EQ(running.grabs()[0].slipped, 0u);
}

// The force is shared by the nodes that the grab took: of dust under gravity g it holds back F / (n m).
TEST_F(Attachments, AWeakGrabPullsWithItsForce) {
  model::Scene scene = dust(3, 3);
  scene.environment.gravity = Vec3(0, -9.81f, 0);
  const Vec3 centre = model::restPositions(scene.cloths[0])[4];
  const float weight = scene.cloths[0].mass * 9.81f;
  Running running(scene);
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.grabs = {taking(centre, 1)};
  inputs.grabs[0].maxForce = 0.25f * weight;
  running.tick(inputs);
  EXPECT_EQ(running.grabs()[0].taken, 9u);
  inputs.grabs = {onTheWay(inputs.grabs[0], centre)};
  for (int tick = 1; tick < 9; ++tick) running.tick(inputs);
  const double seconds = 9.0 / 72;
  for (const Vec3& velocity : running.state().velocities)
    EXPECT_NEAR(velocity.y(), -0.75 * 9.81 * seconds, 1e-4);
  // After 0.1 m all have slipped, and fall freely.
  for (int tick = 9; tick < 18; ++tick) running.tick(inputs);
  EXPECT_EQ(running.grabs()[0].slipped, 9u);
  const double before = double{running.state().velocities[0].y()};
  running.tick(inputs);
  EXPECT_NEAR(running.state().velocities[0].y(), before - 9.81 / 72, 1e-4);
}

TEST_F(Attachments, ReleasedNodesAreFreeAndCanBeGrabbedAgain) {
  model::Scene scene = dust(3, 3);
  const Vec3 centre = model::restPositions(scene.cloths[0])[4];
  Running running(scene);
  simulation::TickInputs inputs = inputsOf(scene);
  inputs.grabs = {taking(centre, 0.001f)};
  running.tick(inputs);
  inputs.grabs = {onTheWay(inputs.grabs[0], centre + Vec3(0, 0, 0.01f))};
  running.tick(inputs);
  EXPECT_NEAR(running.state().velocities[4].z(), 0.72, 1e-3);
  inputs.grabs = {Grab{}};
  running.tick(inputs);
  EXPECT_NEAR(running.state().positions[4].z() - centre.z(), 0.02, 1e-4);
  inputs.grabs = {taking(running.state().positions[4], 0.001f), taking(running.state().positions[4], 0.001f)};
  running.tick(inputs);
  // Two hands grab one node. The first one holds it.
  EXPECT_EQ(running.grabs()[0].taken, 1u);
  EXPECT_EQ(running.grabs()[1].taken, 0u);
  EXPECT_NEAR(running.state().velocities[4].norm(), 0, 1e-4);
}

TEST_F(Attachments, GiveTheSameBitsForEveryPartitionOfWork) {
  model::Scene scene = sceneOf({calmCloth(33, 31)});
  model::Cloth& cloth = scene.cloths[0];
  cloth.attachments = {leftColumn(cloth)};
  cloth.tethers = model::Tethers{};
  const std::vector<Vec3> rest = model::restPositions(cloth);
  const auto hashesOf = [&](simulation::SimulationOptions options) {
    Running running(scene, options);
    std::vector<std::uint64_t> hashes;
    simulation::TickInputs inputs = inputsOf(scene);
    inputs.grabs = {taking(rest[500], 0.07f), taking(rest[504], 0.07f)};
    for (int tick = 1; tick <= 60; ++tick) {
      inputs.attachments = {moved(Vec3(0.01f * static_cast<float>(tick), 0, 0))};
      hashes.push_back(running.tick(inputs).stateHash);
      for (Grab& grab : inputs.grabs) grab = onTheWay(grab, grab.end.position + Vec3(0.001f, 0.002f, 0.004f));
    }
    return hashes;
  };
  const std::vector<std::uint64_t> expected = hashesOf({});
  EXPECT_EQ(hashesOf({.rowsPerInvocation = 3, .workgroupSize = 32}), expected);
  EXPECT_EQ(hashesOf({.workgroupSize = 8}), expected);
}

TEST(HeldNodes, ReturnUnchangedFromTheirRecords) {
  const simulation::HeldNodes held{
      .nodes = {{.node = 1, .grab = 1, .place = {1, 2, 3}}, {.node = 3, .grab = 0, .place = {0, 0, -1}}},
      .grabs = {{.taken = 1, .slipped = 2, .offset = {4, 5, 6}}, {.taken = 7}}};
  std::array<shared::GrabbedNode, 4> nodes;
  nodes.fill({.place = {9, 9, 9}, .grabber = 2});
  std::array<shared::GrabReport, 2> reports;
  simulation::setHeldNodes(held, nodes, reports);
  const simulation::HeldNodes again = simulation::heldNodes(nodes, reports);
  EXPECT_EQ(again.nodes, held.nodes);
  EXPECT_EQ(again.grabs, held.grabs);
}

TEST(HeldNodes, LeaveOutNodesOfUnknownGrabs) {
  const std::array<shared::GrabbedNode, 3> nodes{{{{}, 0}, {{}, 2}, {{}, 1}}};
  const std::array<shared::GrabReport, 1> reports{};
  const simulation::HeldNodes held = simulation::heldNodes(nodes, reports);
  ASSERT_EQ(held.nodes.size(), 1u);
  EXPECT_EQ(held.nodes[0].node, 2u);
  EXPECT_EQ(held.nodes[0].grab, 0u);
}

}  // namespace
}  // namespace clothstream::tests
