// SPDX-License-Identifier: MIT
// Scenes far from the origin of the world.
#include "server/model/origin.h"

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using model::Vec3;

// Distance between neighbouring floats from 512 to 1024, m.
constexpr float kSpacing = 0x1p-14f;

class Origin : public GpuTest {};

// A grid with an attachment and a mesh with self-collision, a ball, and a hand that grabs.
model::Scene sceneAt(const Vec3& place) {
  model::Cloth grid = calmCloth(7, 9), mesh = model::asMesh(calmCloth(5, 5));
  grid.grid.pose.position = place;
  grid.attachments.emplace_back();
  grid.attachments[0].name = "corner";
  grid.attachments[0].vertices = {0};
  grid.attachments[0].pose.position = place;
  mesh.name = "mesh";
  mesh.selfCollision = model::SelfCollision{.radius = 0.009f};
  model::MeshShape shape = mesh.mesh->shape;
  // Numbers that are as exact far away, so that both meshes have the same springs.
  for (Vec3& position : shape.positions)
    position = (1024 * position).array().round().matrix() / 1024 + place + Vec3(0, 0, 0.25f);
  mesh.mesh = std::make_shared<const model::Mesh>(model::makeMesh(shape));
  model::Scene scene = sceneOf({grid, mesh});
  return scene;
}

simulation::TickInputs inputsAt(const model::Scene& scene, const Vec3& place, int tick) {
  const model::Pose ball{place + Vec3(0, -0.125f, 0.0625f), model::Quaternion::Identity()};
  simulation::TickInputs inputs = inputsOf(scene, {{model::Sphere{0.05f}, ball, ball, 1}});
  const model::Pose hand{place + Vec3(0.0625f, -0.0625f, 0), model::Quaternion::Identity()};
  const model::Pose up{hand.position + Vec3(0, 0.015625f, 0), hand.orientation};
  inputs.grabs = {{.state = tick == 0 ? simulation::Grab::State::takes : simulation::Grab::State::holds,
                   .start = hand,
                   .end = tick == 0 ? hand : up}};
  inputs.attachments = {{place + Vec3(0, 0, tick > 5 ? 2.0f : 0.0f), model::Quaternion::Identity()}};
  if (tick == 6) inputs.carries = {{0, {place, model::Quaternion::Identity()}, inputs.attachments[0]}};
  return inputs;
}

TEST_F(Origin, IsZeroNearTheOriginOfTheWorld) {
  EXPECT_EQ(model::originOf(sceneAt(Vec3(30, -20, 10))), Vec3::Zero());
  EXPECT_EQ(model::originOf(sceneAt(Vec3(640, -100, 33))), Vec3(640, -128, 64));
}

// The state is the same to the bit, and what leaves the simulation is moved.
TEST_F(Origin, FarScenesMoveAsNearOnes) {
  const Vec3 far(640, -128, 64);
  const model::Scene here = sceneAt(Vec3::Zero()), there = sceneAt(far);
  Running near(here), away(there);
  for (int tick = 0; tick < 12; ++tick) {
    const simulation::TickStatus one = near.tick(inputsAt(here, Vec3::Zero(), tick));
    const simulation::TickStatus other = away.tick(inputsAt(there, far, tick));
    ASSERT_TRUE(other.healthy);
    EXPECT_EQ(one.stateHash, other.stateHash) << tick;
    // The far box is rounded.
    EXPECT_LT((other.low - far - one.low).norm(), kSpacing);
    EXPECT_LT((other.high - far - one.high).norm(), kSpacing);
  }
  const simulation::StateSnapshot saved = away.save();
  EXPECT_EQ(saved.bytes, near.save().bytes);
  EXPECT_EQ(saved.origin, far);
  EXPECT_EQ(simulation::unpack(saved, far).positions, near.state().positions);
  EXPECT_LT((away.state().positions[40] - far - near.state().positions[40]).norm(), kSpacing);
  const simulation::TickStatus there12 = simulation::statusOf(saved, model::reachOf(there.stream));
  EXPECT_EQ(there12.stateHash, simulation::statusOf(near.save()).stateHash);
  EXPECT_TRUE(there12.healthy);
  EXPECT_FALSE(simulation::statusOf(saved, 0.03f).healthy);
}

TEST_F(Origin, SnapshotsOfEitherKindRestoreTheState) {
  const Vec3 far(640, -128, 64);
  const model::Scene scene = sceneAt(far);
  Running running(scene);
  running.tick(inputsAt(scene, far, 0));
  const simulation::StateSnapshot saved = running.save();
  Running other(scene);
  other.restore(saved);
  EXPECT_EQ(other.save().bytes, saved.bytes);
  other.restore(simulation::inWorld(saved));
  EXPECT_LT((other.state().positions[40] - running.state().positions[40]).norm(), 2 * kSpacing);
}

TEST_F(Origin, ReportsTheEnergyOfTheHeightInTheWorld) {
  const Vec3 high(0, 640, 0);
  const model::Scene here = sceneAt(Vec3::Zero()), there = sceneAt(high);
  Running near(here), away(there);
  const auto one = near.tickAndReport(inputsAt(here, Vec3::Zero(), 0));
  const auto other = away.tickAndReport(inputsAt(there, high, 0));
  double mass = 0;
  for (std::size_t i = 0; i < 63; ++i) mass += i == 0 ? 0 : model::nodeMasses(here.cloths[0])[i];
  const double more = mass * 9.81 * 640;
  EXPECT_NEAR(other[0].gravityEnergy - one[0].gravityEnergy, more, 64 * kRounding * more);
  EXPECT_EQ(other[0].kineticEnergy, one[0].kineticEnergy);
}

}  // namespace
}  // namespace clothstream::tests
