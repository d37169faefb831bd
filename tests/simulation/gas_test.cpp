// SPDX-License-Identifier: MIT
// Gas inside closed cloths on the device: against the reference, its law at rest with every solver, momentum,
// bits, and changes while it runs.
#include "server/model/gas.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "server/model/stability.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using Eigen::Vector3d;
using model::SolverKind;
using simulation::NodeState;

class GasOnDevice : public GpuTest {};

constexpr float kRadius = 0.3f;
constexpr float kStiffness = 200;  // N/m, of a balloon

// 92 or 162 nodes, 50 g.
model::Cloth balloon(float pressure, SolverKind kind = SolverKind::massSpring, std::uint32_t parts = 3) {
  model::Cloth cloth;
  cloth.name = "balloon";
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::icosphere(parts, kRadius)));
  cloth.mass = 0.05f;
  cloth.structural = {kStiffness, 0.01f};
  cloth.damping = 4;
  cloth.pressure = pressure;
  cloth.solver.kind = kind;
  return cloth;
}

model::Scene weightless(std::vector<model::Cloth> cloths, std::uint32_t substeps = 40) {
  model::Scene scene = sceneOf(std::move(cloths));
  scene.environment.gravity = model::Vec3::Zero();
  scene.substeps = substeps;
  return scene;
}

std::vector<Vector3d> placesOf(const NodeState& state) {
  std::vector<Vector3d> places;
  for (const model::Vec3& position : state.positions) places.push_back(position.cast<double>());
  return places;
}

// Volume as a fraction of the volume at rest.
double volumeOf(const model::Cloth& cloth, const NodeState& state) {
  return model::enclosedVolume(cloth.mesh->shape.triangles, placesOf(state)) / cloth.mesh->volume;
}

// Pressure of the law at the volume of the state, Pa.
double pressureOf(const model::Cloth& cloth, const NodeState& state) {
  return (model::kOutsidePressure + double{cloth.pressure}) / volumeOf(cloth, state) -
         model::kOutsidePressure;
}

// Pressure that balances the springs if the whole cloth grows in proportion: the work of both is equal.
double balancingPressure(const model::Cloth& cloth, const NodeState& state) {
  double work = 0;
  for (const model::SpringLink& link : cloth.mesh->links) {
    const double length = (state.positions[link.b] - state.positions[link.a]).cast<double>().norm();
    work += double{model::springOf(cloth, link.kind).stiffness} * (length - double{link.restLength}) * length;
  }
  return work / (3 * volumeOf(cloth, state) * cloth.mesh->volume);
}

// One tick of one substep from a random state. The volume is rounded by the positions, each by kRounding of
// its place, and in the sums of 64 lanes, by kRounding of the largest sum for each of n / 64 + 6 additions
// and ten operations of a term. Of the root, the rounding is 2e-6. The pressure then errs by this over 1 +
// response, and the velocity by the impulse of that.
TEST_F(GasOnDevice, MovesNodesAsTheReference) {
  for (const float pressure : {-30'000.0f, 500.0f, 200'000.0f}) {
    model::Cloth cloth = balloon(pressure);
    model::Scene scene = weightless({cloth}, 1);
    scene.simulationRate = scene.streamRate = 2880;
    std::mt19937 random(3);
    const NodeState start = randomState(scene, random, 0.01f, 0.3f);
    Running running(scene);
    running.restore(start);
    ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
    reference::ReferenceSimulation reference(scene);
    setState(reference, start);
    reference.tick(referenceInputs(inputsOf(scene)));

    const double h = scene.substepSeconds(), nodes = cloth.nodeCount();
    double response = 0, perNode = 0, moment = 0;
    const std::vector<Vector3d> places = placesOf(start);
    const std::vector<Vector3d> gradients = model::volumeGradients(cloth.mesh->shape.triangles, places);
    const std::vector<double> masses = model::nodeMasses(cloth);
    for (std::size_t i = 0; i < gradients.size(); ++i) {
      response += gradients[i].squaredNorm() / masses[i];
      perNode = std::max(perNode, gradients[i].norm() / masses[i]);
      moment += gradients[i].norm() * (places[i] - places[0]).norm() / 3;
    }
    response *= h * h * model::kOutsidePressure / cloth.mesh->volume;
    const double fraction = reference.cloths()[0].gasPressure() / model::kOutsidePressure;
    const double volumeError = (nodes / 64 + 16) * kRounding * moment / cloth.mesh->volume;
    const double error =
        (volumeError * (1 + std::abs(fraction)) + 2e-6 * std::abs(fraction)) / (1 + response) +
        2e-6 * std::abs(fraction);
    const double speedError = h * model::kOutsidePressure * perNode * error +
                              40 * kRounding;  // springs of 200 N/m, and speeds below 1
    EXPECT_LT(largestSpeedDifference(running.state(), reference), speedError) << pressure;
    EXPECT_LT(largestDistance(running.state(), reference), h * speedError + kRounding) << pressure;

    // Without gas the nodes would be elsewhere, so the comparison can fail.
    model::Scene empty = scene;
    empty.cloths[0].pressure = 0;
    reference::ReferenceSimulation other(empty);
    setState(other, start);
    other.tick(referenceInputs(inputsOf(empty)));
    EXPECT_GT(largestSpeedDifference(running.state(), other), 100 * speedError) << pressure;
  }
}

// Also while it grows, and with other stages after the gas.
TEST_F(GasOnDevice, GrowsAsInTheReference) {
  for (const SolverKind kind : {SolverKind::massSpring, SolverKind::acad, SolverKind::implicitEuler}) {
    model::Scene scene = weightless({balloon(3000, kind)});
    scene.cloths[0].solver.tolerance = kSolveTolerance;
    scene.cloths[0].solver.iterations = kSolveIterations;
    Running running(scene);
    reference::ReferenceSimulation reference(scene);
    for (int tick = 0; tick < 4; ++tick) {
      ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
      reference.tick(referenceInputs(inputsOf(scene)));
    }
    const double growth = volumeOf(scene.cloths[0], running.state()) - 1;
    EXPECT_GT(growth, 0.005);
    // A thousandth of the growth of the radius, where rounding would be 1e-6 m.
    EXPECT_LT(largestDistance(running.state(), reference), 1e-3 * growth / 3 * double{kRadius})
        << static_cast<int>(kind);
  }
}

// At rest the pressure that balances the springs is that of the law, whatever the substep and the solver:
// the law holds at the true volume, not at one without the solver's corrections. The volume is rounded to
// 1e-6, which is 0.1 Pa, and residual motion adds less than 1e-3 of the pressure.
TEST_F(GasOnDevice, KeepsItsLawAtRest) {
  struct Case {
    SolverKind kind;
    std::uint32_t substeps;
  };
  for (const Case& each :
       {Case{SolverKind::massSpring, 32}, Case{SolverKind::massSpring, 64}, Case{SolverKind::acad, 32},
        Case{SolverKind::implicitEuler, 16}, Case{SolverKind::xpbd, 32}}) {
    for (const float pressure : {2000.0f, 30'000.0f}) {
      model::Cloth cloth = balloon(pressure, each.kind);
      cloth.solver.activation = 1;  // springs are forces
      cloth.damping = 8;
      const model::Scene scene = weightless({cloth}, each.substeps);
      Running running(scene);
      for (int tick = 0; tick < 216; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
      const NodeState state = running.state();
      const double law = pressureOf(cloth, state);
      EXPECT_NEAR(law, balancingPressure(cloth, state), 0.2 + 1e-3 * law)
          << static_cast<int>(each.kind) << " " << each.substeps << " " << pressure;
      EXPECT_GT(law, 10);
    }
  }
}

// The impulses of a closed surface add up to zero. Each is rounded by kRounding of a velocity below 4 m/s and
// of its gradient, which is gathered from six triangles.
TEST_F(GasOnDevice, MakesNoMomentum) {
  model::Cloth cloth = balloon(100'000);
  cloth.structural = {};
  cloth.damping = 0;
  const model::Scene scene = weightless({cloth}, 16);
  std::mt19937 random(4);
  const NodeState start = randomState(scene, random, 0.01f, 0.3f);
  Running running(scene);
  running.restore(start);
  ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
  const NodeState state = running.state();
  const std::vector<double> masses = model::nodeMasses(cloth);
  Vector3d change = Vector3d::Zero(), turn = Vector3d::Zero();
  double moving = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const Vector3d before = start.velocities[i].cast<double>(), after = state.velocities[i].cast<double>();
    change += masses[i] * (after - before);
    turn += masses[i] * (state.positions[i].cast<double>().cross(after) -
                         start.positions[i].cast<double>().cross(before));
    moving += masses[i] * (after - before).norm();
  }
  EXPECT_GT(moving, 0.02);  // N s: the gas acts
  EXPECT_LT(change.norm(), 16 * 12 * kRounding * moving);
  EXPECT_LT(turn.norm(), 16 * 12 * kRounding * moving);
}

// At the bound of its springs without gas, whatever the pressure; and with one substep for implicit Euler.
TEST_F(GasOnDevice, NeedsNoMoreSubstepsThanItsSprings) {
  for (const float pressure : {-50'000.0f, 10'000.0f, 1'000'000.0f}) {
    model::Cloth cloth = balloon(pressure);
    cloth.mass = 0.002f;
    cloth.damping = 1;
    model::Scene scene = weightless({cloth}, 1);
    const std::uint32_t least = model::stableSubsteps(scene);
    ASSERT_GT(least, 1u);
    scene.cloths[0].pressure = 0;
    ASSERT_EQ(model::stableSubsteps(scene), least);
    scene.cloths[0].pressure = pressure;
    scene.substeps = least;
    Running springs(scene);
    for (int tick = 0; tick < 72; ++tick) ASSERT_TRUE(springs.tick(inputsOf(scene)).healthy) << pressure;
    EXPECT_LT(volumeOf(cloth, springs.state()), 11.5) << pressure;

    scene.cloths[0].solver.kind = SolverKind::implicitEuler;
    scene.cloths[0].structural.stiffness = 20'000;
    scene.substeps = 1;
    Running stiff(scene);
    for (int tick = 0; tick < 72; ++tick) ASSERT_TRUE(stiff.tick(inputsOf(scene)).healthy) << pressure;
    EXPECT_LT(volumeOf(cloth, stiff.state()), 11.5) << pressure;
  }
}

TEST_F(GasOnDevice, GivesTheSameBitsForEveryPartitionOfWork) {
  const model::Scene scene = weightless({balloon(3000), balloon(5000, SolverKind::xpbd, 4), balloon(0)}, 40);
  const simulation::SimulationOptions ways[] = {
      {.rowsPerInvocation = 1, .workgroupSize = 32}, {.workgroupSize = 64}, {.workgroupSize = 128}};
  expectSameBits(
      scene, [](const model::Scene& of, int) { return inputsOf(of); }, 5, ways);
}

// The forecast of the last substep belongs to the state.
TEST_F(GasOnDevice, ContinuesFromASnapshotWithTheSameBits) {
  const model::Scene scene = weightless({balloon(0), balloon(3000, SolverKind::implicitEuler)}, 4);
  Running running(scene);
  for (int tick = 0; tick < 3; ++tick) running.tick(inputsOf(scene));
  const simulation::StateSnapshot snapshot = running.save();
  ASSERT_EQ(snapshot.gas.size(), 2u);
  EXPECT_EQ(snapshot.gas[0], simulation::GasState{});
  EXPECT_GT(snapshot.gas[1].volume, 0.9f);
  running.checkpoint();
  Running other(scene);
  other.restore(snapshot);
  simulation::StateSnapshot forgetful = snapshot;
  forgetful.gas.clear();
  Running third(scene);
  third.restore(forgetful);
  std::uint64_t last = 0;
  bool differs = false;
  for (int tick = 0; tick < 3; ++tick) {
    last = running.tick(inputsOf(scene)).stateHash;
    EXPECT_EQ(other.tick(inputsOf(scene)).stateHash, last);
    differs = differs || third.tick(inputsOf(scene)).stateHash != last;
  }
  EXPECT_TRUE(differs);
  running.rollback();
  for (int tick = 0; tick < 2; ++tick) running.tick(inputsOf(scene));
  EXPECT_EQ(running.tick(inputsOf(scene)).stateHash, last);
}

TEST_F(GasOnDevice, ComesAndGoesWhileItRuns) {
  for (const SolverKind kind : {SolverKind::massSpring, SolverKind::xpbd}) {
    const model::Scene scene = weightless({balloon(0, kind)});
    model::Scene blown = scene;
    blown.cloths[0].pressure = 4000;
    Running running(scene);
    for (int tick = 0; tick < 2; ++tick) ASSERT_TRUE(running.tick(inputsOf(scene)).healthy);
    expectGoesOnAsAlways(running, blown, inputsOf(scene), 3);
    EXPECT_GT(volumeOf(blown.cloths[0], running.state()), 1.001);
    expectGoesOnAsAlways(running, scene, inputsOf(scene), 3);
    expectGoesOnAsAlways(running, blown, inputsOf(scene), 3);
    EXPECT_EQ(running.stagesMade(), 0u);
  }
}

TEST_F(GasOnDevice, CostsNothingWithoutPressure) {
  const model::Scene closed = weightless({balloon(0)}, 10);
  model::Scene open = closed;
  model::MeshShape shape = model::icosphere(3, kRadius);
  shape.triangles.pop_back();
  shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
  open.cloths[0].mesh = std::make_shared<const model::Mesh>(model::makeMesh(shape));
  Running with(closed), without(open);
  EXPECT_EQ(with.dispatches(inputsOf(closed)), without.dispatches(inputsOf(open)));
  model::Scene blown = closed;
  blown.cloths[0].pressure = 100;
  Running blowing(blown);
  EXPECT_EQ(blowing.dispatches(inputsOf(blown)), with.dispatches(inputsOf(closed)) + 30);
}

// Gas presses the nodes on the floor as well, and collisions hold them.
TEST_F(GasOnDevice, StaysOutsideColliders) {
  model::Cloth cloth = balloon(3000);
  cloth.thickness = 0.01f;
  cloth.friction = 0.5f;
  cloth.damping = 8;
  model::Scene scene = sceneOf({cloth});
  scene.substeps = 40;
  const simulation::MovingCollider floor{model::Plane{},
                                         {{0, -0.25f, 0}, model::Quaternion::Identity()},
                                         {{0, -0.25f, 0}, model::Quaternion::Identity()},
                                         1};
  Running running(scene);
  for (int tick = 0; tick < 144; ++tick) {
    ASSERT_TRUE(running.tick(inputsOf(scene, {floor})).healthy);
    for (const model::Vec3& node : running.state().positions) ASSERT_GT(node.y(), -0.25f + 0.01f - 1e-5f);
  }
  double energy = 0;
  const std::vector<double> masses = model::nodeMasses(cloth);
  const NodeState state = running.state();
  for (std::size_t i = 0; i < masses.size(); ++i)
    energy += masses[i] / 2 * state.velocities[i].cast<double>().squaredNorm();
  EXPECT_LT(std::sqrt(2 * energy / double{cloth.mass}), 0.01);  // m/s, root mean square
  // The floor carries its weight, and the gas keeps its law.
  EXPECT_NEAR(pressureOf(cloth, state), balancingPressure(cloth, state), 0.1 * pressureOf(cloth, state));
}

}  // namespace
}  // namespace clothstream::tests
