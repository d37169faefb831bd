// SPDX-License-Identifier: MIT
// Saving, restoring and rolling back states, and detection of invalid states.
#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;
using simulation::StateSnapshot;
using simulation::TickInputs;

class State : public GpuTest {
 protected:
  State() : scene(sceneOf({hung(19, 21), hung(5, 8)})) {}

  static model::Cloth hung(std::uint32_t rows, std::uint32_t columns) {
    model::Cloth cloth = calmCloth(rows, columns);
    cloth.pins = {topRow(cloth)};
    cloth.drag = 0.5f;
    return cloth;
  }

  TickInputs inputs(int tick) const {
    TickInputs inputs = inputsOf(scene);
    inputs.environment.wind = model::Vec3(0, 0, static_cast<float>(tick % 7));
    return inputs;
  }

  void run(Running& running, int from, int to) const {
    for (int tick = from; tick < to; ++tick) running.tick(inputs(tick));
  }

  const model::Scene scene;
};

TEST_F(State, StartsAtRestWhereTheScenePutsIt) {
  Running running(scene);
  const NodeState state = running.state();
  EXPECT_EQ(state.positions, simulation::restState(scene.cloths).positions);
  for (const model::Vec3& velocity : state.velocities) EXPECT_EQ(velocity, model::Vec3::Zero());
}

TEST_F(State, IsRestoredToTheBitAndContinuesUnchanged) {
  Running running(scene);
  run(running, 0, 7);  // an odd number of ticks of an even number of substeps, and the other way round below
  const StateSnapshot saved = running.save();
  run(running, 7, 20);
  const StateSnapshot later = running.save();
  ASSERT_NE(saved.bytes, later.bytes);

  running.restore(saved);
  EXPECT_EQ(running.save().bytes, saved.bytes);
  run(running, 7, 20);
  EXPECT_EQ(running.save().bytes, later.bytes);
}

TEST_F(State, SavesThePresentStateAfterAnOddNumberOfSubsteps) {
  model::Scene odd = scene;
  odd.substeps = 3;
  Running running(odd);
  running.tick(inputs(1));
  for (int tick = 2; tick < 6; ++tick) {
    const std::uint64_t hash = running.tick(inputs(tick)).stateHash;
    EXPECT_EQ(simulation::statusOf(running.save()).stateHash, hash);
  }
}

TEST_F(State, ContinuesOnAnotherDeviceWithTheSameHashes) {
  Running here(scene);
  run(here, 0, 10);
  const StateSnapshot moved = here.save();
  vulkan::Device second;
  Running there(scene, {}, second);
  there.restore(moved);
  for (int tick = 10; tick < 30; ++tick)
    ASSERT_EQ(there.tick(inputs(tick)).stateHash, here.tick(inputs(tick)).stateHash) << "tick " << tick;
}

TEST_F(State, RefusesASnapshotOfAnotherScene) {
  Running running(scene), other(sceneOf({hung(3, 3)}));
  EXPECT_THROW(running.restore(other.save()), std::invalid_argument);
}

TEST_F(State, RollsBackToTheCheckpointOrElseToTheStart) {
  Running running(scene);
  const StateSnapshot start = running.save();
  run(running, 0, 3);
  running.rollback();
  EXPECT_EQ(running.save().bytes, start.bytes);

  run(running, 0, 5);
  const StateSnapshot kept = running.save();
  running.checkpoint();
  run(running, 5, 9);
  running.rollback();
  EXPECT_EQ(running.save().bytes, kept.bytes);
}

TEST_F(State, DetectsBadNumbersInTheSameTickAndRollsBack) {
  const float bad[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                       -std::numeric_limits<float>::infinity(), 2 * simulation::kWorldExtent};
  Running running(scene);
  for (const float number : bad) {
    run(running, 0, 4);
    const StateSnapshot good = running.save();
    running.checkpoint();
    NodeState spoilt = simulation::unpack(good);
    // The last component of the last node, which shows that the whole state is checked.
    spoilt.positions.back().z() = number;
    running.restore(spoilt);
    EXPECT_FALSE(running.tick(inputs(4)).healthy) << number;
    running.restore(good);
    EXPECT_TRUE(running.tick(inputs(4)).healthy);
    running.rollback();
    EXPECT_EQ(running.save().bytes, good.bytes);
  }
}

TEST_F(State, HasTheHashOfTheExampleInFrameFormat) {
  const NodeState state{{{0, 0, 0}, {1, -2, 0.5f}}, {{0, 0, 0}, {0, 0, -9.81f}}};
  EXPECT_EQ(simulation::statusOf(simulation::pack(state, 0)).stateHash, 0x8ffef53b60285831u);
}

TEST_F(State, DetectsAPositionThatTheStreamCannotHold) {
  const float reach = model::reachOf(scene.stream);
  Running running(scene);
  run(running, 0, 4);
  const StateSnapshot good = running.save();
  const auto statusAt = [&](float coordinate, float speed) {
    NodeState state = simulation::unpack(good);
    for (model::Vec3& velocity : state.velocities) velocity = {0, 0, 0};
    state.positions.back().z() = coordinate;
    state.velocities.back().z() = speed;
    return simulation::statusOf(simulation::pack(state, 4), reach);
  };
  EXPECT_TRUE(statusAt(-reach, 2 * reach).healthy);
  EXPECT_FALSE(statusAt(-reach, 2 * reach).outOfReach);
  EXPECT_FALSE(statusAt(std::nextafter(reach, 1e6f), 0).healthy);
  EXPECT_TRUE(statusAt(std::nextafter(reach, 1e6f), 0).outOfReach);
  // A state that is wrong anyway is not called out of reach.
  EXPECT_FALSE(statusAt(2 * simulation::kWorldExtent, 0).outOfReach);
  EXPECT_FALSE(statusAt(0, std::numeric_limits<float>::quiet_NaN()).outOfReach);

  // The device says the same.
  NodeState far = simulation::unpack(good);
  for (model::Vec3& position : far.positions) position.x() += 1.01f * reach;
  running.restore(far);
  const simulation::TickStatus status = running.tick(inputs(4));
  EXPECT_FALSE(status.healthy);
  EXPECT_TRUE(status.outOfReach);
  EXPECT_EQ(status.stateHash, simulation::statusOf(running.save(), reach).stateHash);
  EXPECT_TRUE(simulation::statusOf(running.save(), reach).outOfReach);
}

TEST_F(State, RollsBackADivergingState) {
  // The scene is far beyond the stability bound, so its motion diverges within a few ticks.
  model::Scene stiff = sceneOf({calmCloth(16, 16)});
  stiff.cloths[0].structural.stiffness = 1e5f;
  std::mt19937 random(1);
  Running running(stiff);
  running.restore(randomState(stiff, random, 0.001f, 0));
  running.checkpoint();
  const StateSnapshot good = running.save();
  int ticks = 0;
  while (running.tick(inputsOf(stiff)).healthy) ASSERT_LT(++ticks, 100);
  running.rollback();
  EXPECT_EQ(running.save().bytes, good.bytes);
}

TEST_F(State, ParametersChangeFromTheNextTickOn) {
  Running changed(scene), fromTheStart(scene);
  std::vector<model::Cloth> softer = scene.cloths;
  for (model::Cloth& cloth : softer) {
    cloth.structural.stiffness *= 0.5f;
    cloth.damping = 2;
  }
  run(changed, 0, 3);
  run(fromTheStart, 0, 3);
  const StateSnapshot before = changed.save();
  changed.setCloths(softer);
  EXPECT_EQ(changed.save().bytes, before.bytes);
  run(changed, 3, 6);
  run(fromTheStart, 3, 6);
  EXPECT_NE(changed.save().bytes, fromTheStart.save().bytes);

  model::Scene softScene = scene;
  softScene.cloths = softer;
  Running soft(softScene);
  soft.restore(before);
  run(soft, 3, 6);
  EXPECT_EQ(changed.save().bytes, soft.save().bytes);
}

TEST_F(State, ParametersMayChangeWhileATickIsInFlight) {
  std::vector<model::Cloth> softer = scene.cloths;
  for (model::Cloth& cloth : softer) cloth.structural.stiffness *= 0.5f;
  simulation::ClothSimulation overlapped(device(), scene);
  vulkan::Recorder first(device()), second(device());
  first.begin();
  overlapped.recordTick(first, inputs(1));
  device().submit(first);
  overlapped.setCloths(softer);
  second.begin();
  overlapped.recordTick(second, inputs(2));
  submitAndWait(device(), second);

  Running oneByOne(scene);
  oneByOne.tick(inputs(1));
  oneByOne.setCloths(softer);
  EXPECT_EQ(overlapped.status().stateHash, oneByOne.tick(inputs(2)).stateHash);
}

TEST(StateSnapshots, PackAndUnpackKeepEveryBit) {
  const NodeState state{{{1, -0.0f, 3e-30f}, {4, 5, 6}}, {{0, 1e30f, 0}, {7, 8, 9}}};
  const StateSnapshot snapshot = simulation::pack(state, 12);
  EXPECT_EQ(snapshot.tick, 12u);
  EXPECT_EQ(snapshot.bytes.size(), 2 * simulation::kSnapshotBytesPerNode);
  EXPECT_EQ(simulation::pack(simulation::unpack(snapshot), 12).bytes, snapshot.bytes);
}

}  // namespace
}  // namespace clothstream::tests
