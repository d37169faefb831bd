// SPDX-License-Identifier: MIT
// The same inputs give the same bits for every partition of the work, next to other cloths, and on every
// device.
#include <array>
#include <cmath>
#include <memory>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "server/vulkan/batch.h"
#include "server/vulkan/buffer.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::NodeState;
using simulation::StateSnapshot;
using simulation::TickInputs;
using simulation::TickStatus;

// Everything at once: cloths of two sizes, wind, friction, damping and pins. A sphere passes through, and
// there is a collider of every other shape; some of them rotate.
model::Scene busyScene() {
  model::Cloth curtain = calmCloth(37, 29);
  curtain.pins = {topRow(curtain)};
  curtain.drag = 0.6f;
  curtain.lift = 0.4f;
  model::Cloth rag = calmCloth(13, 70);
  rag.grid.pose.position = model::Vec3(0.1f, 0.3f, 0.2f);
  rag.friction = 0.8f;
  model::Scene scene = sceneOf({curtain, rag});
  scene.environment.wind = model::Vec3(1, 0, 3);
  return scene;
}

TickInputs busyInputs(const model::Scene& scene, int tick) {
  const auto z = [](int t) { return 0.4f - 0.01f * static_cast<float>(t % 80); };
  const auto turn = [](int t) { return turned(3 * static_cast<float>(t % 120), model::Vec3(1, 2, 0.5f)); };
  const model::Pose floor{model::Vec3(0, -0.7f, 0), turned(5, model::Vec3::UnitX())};
  const model::Pose stone{model::Vec3(-0.2f, -0.5f, 0.05f), turned(40, model::Vec3(1, 1, 0))};
  return inputsOf(
      scene,
      {{model::Sphere{0.12f}, {model::Vec3(0, -0.4f, z(tick))}, {model::Vec3(0, -0.4f, z(tick) - 0.01f)}, 1},
       {model::Box{model::Vec3(0.1f, 0.3f, 0.1f)},
        {model::Vec3(0.2f, -0.2f, z(tick + 40)), turn(tick)},
        {model::Vec3(0.2f, -0.2f, z(tick + 40) - 0.01f), turn(tick + 1)},
        1},
       {model::Capsule{.radius = 0.04f, .length = 0.2f},
        {model::Vec3(-0.1f, -0.1f, 0.02f), turn(2 * tick)},
        {model::Vec3(-0.1f, -0.1f, 0.02f), turn(2 * tick + 2)},
        0.5f},
       {octahedron(), stone, stone, 1},
       {model::Plane{}, floor, floor, 1}});
}

class Determinism : public GpuTest {};

TEST_F(Determinism, GivesTheSameHashesInLongRuns) {
  const model::Scene scene = busyScene();
  Running narrow(scene, {.rowsPerInvocation = 1, .workgroupSize = 32, .advanceKernel = {}});
  Running wide(scene, {.rowsPerInvocation = 7, .workgroupSize = 128, .advanceKernel = {}});
  Running usual(scene), again(scene);
  for (int tick = 0; tick < longRunTicks(); ++tick) {
    const TickInputs inputs = busyInputs(scene, tick);
    const TickStatus status = usual.tick(inputs);
    ASSERT_TRUE(status.healthy) << "tick " << tick;
    ASSERT_EQ(again.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
    if (tick >= 100) continue;
    ASSERT_EQ(narrow.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
    ASSERT_EQ(wide.tick(inputs).stateHash, status.stateHash) << "tick " << tick;
  }
}

// The hash is the same on every device. A device that fails here can neither continue the scenes of another
// device nor replay its recordings.
TEST_F(Determinism, TheHashAfterOneHundredTicksIsThatOfEveryOtherDevice) {
  const model::Scene scene = busyScene();
  Running running(scene);
  TickStatus status;
  for (int tick = 0; tick < 100; ++tick) status = running.tick(busyInputs(scene, tick));
  EXPECT_EQ(status.stateHash, 0xfa52af6d27e3b8bbu);
}

TEST_F(Determinism, ClothsInOneSceneMoveAsEachAlone) {
  const std::pair<std::uint32_t, std::uint32_t> shapes[] = {{2, 2}, {3, 65}, {65, 3}, {31, 33}, {64, 64}};
  std::vector<model::Cloth> cloths;
  for (const auto& [rows, columns] : shapes) {
    model::Cloth cloth = calmCloth(rows, columns);
    // Each cloth has a different material. The first has neither air nor damped springs, which must not
    // change because of the others.
    const auto i = static_cast<float>(cloths.size());
    cloth.drag = 0.3f * i;
    cloth.structural.damping = cloth.shear.damping = cloth.bend.damping = 0.05f * i;
    cloth.damping = 0.2f * i;
    cloths.push_back(cloth);
  }
  const model::Scene together = sceneOf(cloths);
  std::mt19937 random(3);
  const NodeState start = randomState(together, random, 0.004f, 0.5f);
  Running all(together);
  all.restore(start);
  const TickInputs inputs = busyInputs(together, 35);
  for (int tick = 0; tick < 5; ++tick) all.tick(inputs);
  const NodeState end = all.state();
  EXPECT_NE(end.positions, start.positions);

  const std::vector<std::uint32_t> offsets = simulation::clothOffsets(cloths);
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    const auto part = [&](const std::vector<model::Vec3>& whole) {
      return std::vector<model::Vec3>(whole.begin() + offsets[i], whole.begin() + offsets[i + 1]);
    };
    Running alone(sceneOf({cloths[i]}));
    alone.restore(NodeState{part(start.positions), part(start.velocities)});
    for (int tick = 0; tick < 5; ++tick) alone.tick(inputs);
    const NodeState own = alone.state();
    EXPECT_EQ(own.positions, part(end.positions)) << "cloth " << i;
    EXPECT_EQ(own.velocities, part(end.velocities)) << "cloth " << i;
  }
}

// Small cloths with every solver and every feature that has buffers.
model::Scene sceneOfAllStages() {
  std::vector<model::Cloth> cloths(8, calmCloth(9, 7));
  cloths[1].solver.kind = model::SolverKind::constraint;
  cloths[2] = assembled(calmCloth(9, 7), true);
  cloths[3].solver.kind = model::SolverKind::acad;
  cloths[4].solver.kind = model::SolverKind::implicitEuler;
  cloths[5].solver.kind = model::SolverKind::xpbd;
  cloths[5].solver.iterations = 3;
  cloths[5].coarse = model::CoarseCorrection{};
  cloths[6] = discCloth(4);
  cloths[6].solver.kind = model::SolverKind::acad;
  cloths[6].selfCollision = model::SelfCollision{.radius = 0.008f};
  cloths[7].selfCollision = model::SelfCollision{.radius = 0.008f, .nothingPasses = true};
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    cloths[i].grid.pose.position.z() = 0.04f * static_cast<float>(i);
    cloths[i].drag = 0.5f;
    if (i != 6) cloths[i].pins = {topRow(cloths[i])};
  }
  cloths[0].dihedralBending = 1e-5f;
  return sceneOf(cloths);
}

// Scenes of two shapes, two of each with different data, and one of a third shape.
std::vector<model::Scene> companions() {
  std::vector<model::Scene> scenes{sceneOfAllStages(), busyScene(), sceneOfAllStages(), busyScene(),
                                   sceneOf({calmCloth(5, 70)})};
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    scenes[i].environment.gravity.x() = static_cast<float>(i);
    scenes[i].cloths.front().drag = 0.1f * static_cast<float>(i + 1);
  }
  return scenes;
}

struct Member {
  Member(vulkan::Device& on, const model::Scene& scene) : simulation(on, scene), recorder(on) {}
  simulation::ClothSimulation simulation;
  vulkan::Recorder recorder;
};

// The same ticks on the shared device, one scene after the other, and on `device`, all together.
void expectTheSameInABatch(vulkan::Device& device) {
  const std::vector<model::Scene> scenes = companions();
  std::vector<std::unique_ptr<Running>> alone;
  std::vector<std::unique_ptr<Member>> together;
  for (const model::Scene& scene : scenes) {
    alone.push_back(std::make_unique<Running>(scene));
    together.push_back(std::make_unique<Member>(device, scene));
  }
  vulkan::Batch batch(device);
  for (int tick = 0; tick < 4; ++tick) {
    batch.begin();
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      Member& member = *together[i];
      member.recorder.begin();
      member.simulation.recordTick(member.recorder, busyInputs(scenes[i], tick + static_cast<int>(i)));
      member.simulation.recordNormals(member.recorder);
      batch.add(member.recorder);
    }
    ASSERT_TRUE(device.wait(device.submit(batch)));
    batch.shareTimes();
    for (std::size_t i = 0; i < scenes.size(); ++i)
      EXPECT_EQ(together[i]->simulation.status().stateHash,
                alone[i]->tick(busyInputs(scenes[i], tick + static_cast<int>(i))).stateHash)
          << "scene " << i << ", tick " << tick;
  }
}

TEST_F(Determinism, ScenesSideBySideMoveAsAlone) {
  vulkan::Device device({.sharing = vulkan::KernelSharing::never});
  expectTheSameInABatch(device);
}

TEST_F(Determinism, ScenesThatShareDispatchesMoveAsAlone) {
  vulkan::Device device({.sharing = vulkan::KernelSharing::always});
  if (!device.sharesKernels()) GTEST_SKIP() << "the device has no addresses of buffers";
  expectTheSameInABatch(device);
}

// Commands of the second tick of this many scenes in a batch.
vulkan::CommandCounts commandsOf(vulkan::Device& device, std::size_t scenes) {
  const model::Scene scene = busyScene();
  std::vector<std::unique_ptr<Member>> members;
  for (std::size_t i = 0; i < scenes; ++i) members.push_back(std::make_unique<Member>(device, scene));
  vulkan::Batch batch(device);
  for (int tick = 0; tick < 2; ++tick) {
    batch.begin();
    for (const auto& member : members) {
      member->recorder.begin();
      member->simulation.recordTick(member->recorder, busyInputs(scene, tick));
      batch.add(member->recorder);
    }
    device.wait(device.submit(batch));
  }
  return batch.counts();
}

TEST_F(Determinism, ABatchOfEqualScenesHasTheCommandsOfOne) {
  vulkan::Device device({.sharing = vulkan::KernelSharing::always});
  if (!device.sharesKernels()) GTEST_SKIP() << "the device has no addresses of buffers";
  const vulkan::CommandCounts one = commandsOf(device, 1), two = commandsOf(device, 2);
  EXPECT_EQ(commandsOf(device, 20), two);
  EXPECT_LE(two.barriers, one.barriers);
  // Copies and fills become dispatches.
  EXPECT_EQ(two.copies, 0u);
  EXPECT_EQ(two.dispatches, one.dispatches + one.copies);
}

constexpr std::array kPurposes{vulkan::BufferPurpose::state, vulkan::BufferPurpose::texels,
                               vulkan::BufferPurpose::indirect, vulkan::BufferPurpose::upload,
                               vulkan::BufferPurpose::readback};

// Fills the memory that the next buffers get.
void fillFreeMemory(vulkan::Device& device, std::uint32_t value) {
  for (const vulkan::BufferPurpose purpose : kPurposes) {
    const vulkan::Buffer buffer(device, purpose, 8 << 20);
    vulkan::Recorder recorder(device);
    recorder.begin();
    recorder.fill(buffer, value, buffer.bytes());
    submitAndWait(device, recorder);
  }
}

TEST_F(Determinism, OldContentsOfMemoryChangeNothing) {
  const model::Scene scene = sceneOfAllStages();
  vulkan::Device device;
  // The first allocation of each type of memory has room for everything below.
  for (const vulkan::BufferPurpose purpose : kPurposes) vulkan::Buffer(device, purpose, 24 << 20);
  const std::uint64_t reserved = device.reservedBytes();
  const Running first(scene, {}, device);  // keeps the kernels
  std::set<std::uint64_t> hashes;
  for (const std::uint32_t value : {0u, 0x40404040u, ~0u}) {
    fillFreeMemory(device, value);
    hashes.insert(hashAfter(scene, passingBall, 3, {}, device));
  }
  EXPECT_EQ(hashes.size(), 1u);
  EXPECT_EQ(device.reservedBytes(), reserved) << "the simulations had other memory";
}

TEST_F(Determinism, TheHashOfTheDeviceEqualsThatOfTheCpu) {
  const model::Scene scene = busyScene();
  Running running(scene);
  for (int tick = 0; tick < 3; ++tick) {
    const TickStatus status = running.tick(busyInputs(scene, tick));
    EXPECT_EQ(status.stateHash, simulation::statusOf(running.save()).stateHash);
  }
}

TEST_F(Determinism, NoStoredComponentIsBelowTheSmallestNumber) {
  // A cloth at rest in its plane: everything sideways is zero or decays towards it.
  model::Scene scene = sceneOf({calmCloth(8, 8)});
  NodeState state = simulation::restState(scene.cloths);
  for (model::Vec3& velocity : state.velocities) velocity.z() = 3e-20f;
  Running running(scene);
  running.restore(state);
  for (int tick = 0; tick < 100; ++tick) {
    running.tick(inputsOf(scene));
    const NodeState now = running.state();
    for (const auto* vectors : {&now.positions, &now.velocities})
      for (const model::Vec3& v : *vectors)
        for (const float component : v)
          ASSERT_TRUE(component == 0 || std::abs(component) >= 1e-20f) << component;
  }
}

TEST(StateHash, ChangesWithEveryBitAndWithTheOrderOfNodes) {
  NodeState state{{{1, 2, 3}, {4, 5, 6}}, {{0, 0, 0}, {7, 8, 9}}};
  const auto hash = [](const NodeState& s) { return simulation::statusOf(simulation::pack(s, 0)).stateHash; };
  const std::uint64_t original = hash(state);
  NodeState swapped = state;
  std::swap(swapped.positions[0], swapped.positions[1]);
  std::swap(swapped.velocities[0], swapped.velocities[1]);
  EXPECT_NE(hash(swapped), original);
  const StateSnapshot snapshot = simulation::pack(state, 0);
  std::set<std::uint64_t> hashes{original};
  for (std::size_t bit = 0; bit < snapshot.bytes.size() * 8; ++bit) {
    StateSnapshot flipped = snapshot;
    flipped.bytes[bit / 8] ^= std::byte{1} << (bit % 8);
    hashes.insert(simulation::statusOf(flipped).stateHash);
  }
  EXPECT_EQ(hashes.size(), snapshot.bytes.size() * 8 + 1);
}

}  // namespace
}  // namespace clothstream::tests
