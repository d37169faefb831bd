// SPDX-License-Identifier: MIT
// Cloth against meshes whose vertices follow joints.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/reference/solid.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::MovingCollider;
using simulation::NodeState;

class SkinCollision : public GpuTest {};

// A rod along X from -0.2 to 0.2 m, of two joints: the first at the origin, the second at its middle.
model::Solid bendingRod(const model::Solid& straight = model::rodMesh(0.03f, 0.4f, 16, 24)) {
  model::ClosedMesh rod = *straight;
  model::Skin skin;
  skin.joints = {{"root", std::nullopt, {}},
                 {"elbow", 0, {model::Vec3(0.01f, 0, 0), model::Quaternion::Identity()}}};
  for (const model::Vec3& vertex : rod.vertices) {
    const float bent = std::clamp(vertex.x() / 0.1f + 0.5f, 0.0f, 1.0f);
    skin.vertices.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
  }
  rod.skin = skin;
  return std::make_shared<const model::ClosedMesh>(std::move(rod));
}

// The poses of the joints if the elbow is bent by this angle about Z.
std::vector<model::Pose> bent(const model::Solid& rod, float degrees) {
  std::vector<model::Pose> local = model::restJoints(*rod->skin), poses;
  local[0].position.y() = 0.0001f * degrees;
  local[1].orientation = turned(degrees, model::Vec3::UnitZ());
  model::compose(*rod->skin, local, poses);
  return poses;
}

model::Scene skinScene(model::Cloth cloth, const model::Solid& solid) {
  model::Scene scene = sceneOf({std::move(cloth)});
  scene.colliders.push_back({.name = "solid", .shape = solid});
  return scene;
}

MovingCollider bending(const model::Solid& rod, float from, float to) {
  MovingCollider collider{rod, {model::Vec3(0, -0.1f, 0.02f), turned(20, model::Vec3(0, 1, 1))}, {}, 1};
  collider.end = collider.start;
  collider.jointsStart = bent(rod, from);
  collider.jointsEnd = bent(rod, to);
  return collider;
}

TEST_F(SkinCollision, NodesTouchABendingMeshAsInTheReference) {
  const model::Solid rod = bendingRod();
  model::Scene scene = skinScene(looseCloth(33, 33), rod);
  scene.substeps = 2;
  scene.simulationRate = 360;
  scene.environment.gravity = model::Vec3::Zero();
  std::mt19937 random(18);
  NodeState start = randomState(scene, random, 0, 2);
  std::uniform_real_distribution<float> unit(-0.2f, 0.2f);
  for (model::Vec3& position : start.positions)
    position = model::Vec3(unit(random), unit(random), unit(random));
  const simulation::TickInputs inputs = inputsOf(scene, {bending(rod, 40, 43)});
  Running running(scene);
  running.restore(start);
  EXPECT_TRUE(running.tick(inputs).healthy);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputs));
  const NodeState after = running.state();
  // As for rigid meshes, twice for the two substeps, and for the skin.
  const double distance = 80 * kRounding * 0.5;
  EXPECT_LT(largestDistance(after, reference), distance);
  EXPECT_LT(largestSpeedDifference(after, reference), 10 * distance / 1e-4);
  std::size_t moved = 0;
  for (std::size_t i = 0; i < start.positions.size(); ++i)
    moved += (after.positions[i] - start.positions[i] - start.velocities[i] / 360).norm() > 1e-4f;
  EXPECT_GT(moved, 20u);
}

// The outer half of the rod sweeps through the nodes at up to 12 m/s and takes those in its way along.
TEST_F(SkinCollision, ASwingingLimbPassesThroughNoNode) {
  const model::Solid rod = bendingRod();
  model::Cloth cloth = looseCloth(21, 21);
  cloth.thickness = 0.002f;
  model::Scene scene = skinScene(cloth, rod);
  scene.environment.gravity = model::Vec3::Zero();
  NodeState start = simulation::restState(scene.cloths);
  for (std::size_t i = 0; i < start.positions.size(); ++i)
    start.positions[i] = model::Vec3(0.08f + 0.005f * static_cast<float>(i % 21), 0.1f,
                                     0.002f * static_cast<float>(i / 21) - 0.02f);
  Running running(scene);
  running.restore(start);
  const auto at = [&](float from, float to) {
    MovingCollider collider{rod, {}, {}, 1};
    collider.jointsStart = bent(rod, from);
    collider.jointsEnd = bent(rod, to);
    return collider;
  };
  double deepest = 0;
  for (int tick = 0; tick < 8; ++tick) {
    const auto angle = [](int t) { return 15 * static_cast<float>(t); };
    const MovingCollider collider = at(angle(tick), angle(tick + 1));
    running.tick(inputsOf(scene, {collider}));
    const model::ClosedMesh now = reference::moved(*rod, collider.jointsEnd, collider.jointsEnd, 1);
    for (const model::Vec3& position : running.state().positions)
      deepest = std::max(deepest, 0.002 - reference::nearestOn(now, position.cast<double>()).distance);
  }
  EXPECT_LT(deepest, 5e-6);
  std::size_t carried = 0;
  const NodeState after = running.state();
  for (std::size_t i = 0; i < after.positions.size(); ++i)
    carried += (after.positions[i] - start.positions[i]).norm() > 0.02f;
  EXPECT_GT(carried, 200u);
}

TEST_F(SkinCollision, GivesTheSameBitsForEveryPartitionOfTheWork) {
  const model::Scene scene = skinScene(calmCloth(21, 19), bendingRod());
  const InputsAt inputs = [](const model::Scene& in, int tick) {
    const auto angle = [](int t) { return 60 * std::sin(0.1f * static_cast<float>(t)); };
    return inputsOf(in,
                    {bending(std::get<model::Solid>(in.colliders[0].shape), angle(tick), angle(tick + 1))});
  };
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 32}, {.workgroupSize = 128}};
  expectSameBits(scene, inputs, 60, ways);
}

// A turn whose quaternion has the same bits on every machine, in contrast to sine and cosine. The axis has
// length 1, and `k` is the tangent of a quarter of the angle.
model::Quaternion exactTurn(float k, const model::Vec3& axis) {
  const float scale = 1 / (1 + k * k), sine = 2 * k * scale;
  return {(1 - k * k) * scale, sine * axis.x(), sine * axis.y(), sine * axis.z()};
}

// A mesh whose vertices have the same bits on every machine: they are multiples of 1/4096 m.
model::Solid snapped(const model::Solid& solid) {
  std::vector<model::Vec3> vertices = solid->vertices;
  for (model::Vec3& vertex : vertices)
    for (int axis = 0; axis < 3; ++axis) vertex[axis] = std::round(vertex[axis] * 4096) / 4096;
  return model::solidOf(std::move(vertices), solid->triangles);
}

// A rod that bends, and a rigid ring that flies through the cloth. The bits do not depend on the device, nor
// on its vector width (CMakeLists.txt), nor on its kernel settings.
TEST_F(SkinCollision, ReachesTheHashOfEveryOtherDevice) {
  model::Scene scene = skinScene(calmCloth(21, 19), bendingRod(snapped(model::rodMesh(0.03f, 0.4f, 16, 24))));
  scene.cloths[0].pins = {topRow(scene.cloths[0])};
  scene.colliders.push_back({.name = "ring", .shape = snapped(model::torus(0.12f, 0.02f, 24, 8))});
  const InputsAt inputs = [](const model::Scene& in, int tick) {
    const auto& rod = std::get<model::Solid>(in.colliders[0].shape);
    const auto joints = [&](int t) {
      std::vector<model::Pose> local = model::restJoints(*rod->skin), poses;
      local[1].orientation = exactTurn(0.0125f * static_cast<float>(t), model::Vec3::UnitZ());
      model::compose(*rod->skin, local, poses);
      return poses;
    };
    const auto at = [](int t) {
      return model::Pose{model::Vec3(0, -0.3f, 0.1f - 0.005f * static_cast<float>(t)),
                         exactTurn(0.01f * static_cast<float>(t), model::Vec3(0.6f, 0, 0.8f))};
    };
    const auto rodAt = [](int t) {
      return model::Pose{model::Vec3(0, -0.1f, 0.06f - 0.002f * static_cast<float>(t)),
                         model::Quaternion::Identity()};
    };
    return inputsOf(in, {{rod, rodAt(tick), rodAt(tick + 1), 1, joints(tick), joints(tick + 1)},
                         {in.colliders[1].shape, at(tick), at(tick + 1), 1}});
  };
  Running running(scene);
  std::vector<bool> touched(2);
  for (int tick = 0; tick < 40; ++tick) {
    simulation::TickInputs now = inputs(scene, tick);
    now.reportsContacts = true;
    running.tick(now);
    for (const simulation::ContactStatus& contact : running.contacts()) touched[contact.collider] = true;
  }
  EXPECT_TRUE(touched[0] && touched[1]);
  constexpr std::uint64_t kHash = 0xcc65f004f88b256cu;
  EXPECT_EQ(hashAfter(scene, inputs, 40), kHash);
  for (const vulkan::KernelSettings kernels : {vulkan::KernelSettings::cpu, vulkan::KernelSettings::gpu}) {
    vulkan::Device device({.kernels = kernels});
    EXPECT_EQ(hashAfter(scene, inputs, 40, {}, device), kHash);
  }
}

}  // namespace
}  // namespace clothstream::tests
