// SPDX-License-Identifier: MIT
// Cloth that follows the joints of a collider.
#include "server/model/cloth_skin.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using simulation::MovingCollider;
using simulation::NodeState;

class ClothSkins : public GpuTest {};

constexpr std::uint32_t kRows = 13, kColumns = 17;

// A rod along X of two joints, as long as the cloth is wide: the elbow is at its middle. It is far below the
// cloth, so that nothing touches it.
model::Solid lowRod() {
  model::ClosedMesh rod = *model::rodMesh(0.03f, 0.32f, 8, 12);
  for (model::Vec3& vertex : rod.vertices) vertex.y() -= 1;
  model::Skin skin;
  skin.joints = {{"root", std::nullopt, {}}, {"elbow", 0, {}}};
  for (const model::Vec3& vertex : rod.vertices) {
    const float bent = std::clamp(vertex.x() / 0.1f + 0.5f, 0.0f, 1.0f);
    skin.vertices.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
  }
  rod.skin = skin;
  return std::make_shared<const model::ClosedMesh>(std::move(rod));
}

// Limits by row: the first follows exactly, the next four have distances, the next four also backstops, small
// and large ones, and the others are free.
model::SkinLimits limitsOfRow(std::uint32_t row) {
  if (row == 0) return {.maxDistance = 0};
  if (row < 5) return {.maxDistance = 0.01f * static_cast<float>(row)};
  if (row < 7) return {.maxDistance = 0.05f, .backstopDistance = 0.002f, .backstopRadius = 0.02f};
  if (row < 9) return {.backstopDistance = 0.001f, .backstopRadius = 40};
  return {};
}

// A sheet in the frame of the rod, above it, whose nodes follow the joint on their side.
model::Scene sleeveScene(model::Cloth cloth, const model::Pose& pose = {}) {
  const model::Solid rod = lowRod();
  auto skin = std::make_shared<model::ClothSkin>();
  skin->collider = "rod";
  const std::vector<model::Vec3> places = model::restPositions(cloth);
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node) {
    const float bent = std::clamp(places[node].x() / 0.1f + 0.5f, 0.0f, 1.0f);
    skin->joints.push_back({{0, 1, 0, 0}, {1 - bent, bent, 0, 0}});
    skin->limits.push_back(limitsOfRow(node / cloth.grid.columns));
  }
  const model::Collider collider{.name = "rod", .shape = rod, .pose = pose};
  model::complete(*skin, cloth, collider);
  cloth.skin = skin;
  model::Scene scene = sceneOf({std::move(cloth)});
  scene.colliders.push_back(collider);
  return scene;
}

std::vector<model::Pose> elbowAt(const model::Solid& rod, float degrees) {
  std::vector<model::Pose> local = model::restJoints(*rod->skin), poses;
  local[0].position.y() = 0.0001f * degrees;
  local[1].orientation = turned(degrees, model::Vec3(0.2f, 0.1f, 1));
  model::compose(*rod->skin, local, poses);
  return poses;
}

// The rod moves along a line and turns while the elbow bends.
MovingCollider bendingRodAt(const model::Scene& scene, float tick) {
  const auto& rod = std::get<model::Solid>(scene.colliders[0].shape);
  const auto pose = [](float t) {
    return model::Pose{model::Vec3(0.01f * t, 0.5f, -0.02f * t), turned(2 * t, model::Vec3(0, 1, 0.3f))};
  };
  MovingCollider collider{rod, pose(tick), pose(tick + 1), 1};
  collider.jointsStart = elbowAt(rod, 3 * tick);
  collider.jointsEnd = elbowAt(rod, 3 * (tick + 1));
  return collider;
}

simulation::TickInputs bendingInputs(const model::Scene& scene, int tick) {
  return inputsOf(scene, {bendingRodAt(scene, static_cast<float>(tick))});
}

// Skinned places at a tick's end.
std::vector<Eigen::Vector3d> placesAfter(const model::Scene& scene, const MovingCollider& collider) {
  return model::skinnedPlaces(scene.cloths[0], model::skinOf(scene, scene.cloths[0]), collider.end,
                              collider.jointsEnd);
}

// Each node at its place at the start of the collider's motion, displaced and moving.
NodeState stateNear(const model::Scene& scene, const MovingCollider& collider, float displacement) {
  std::mt19937 random(7);
  NodeState state = randomState(scene, random, 0, 1);
  std::uniform_real_distribution<float> off(-displacement, displacement);
  const std::vector<Eigen::Vector3d> places = model::skinnedPlaces(
      scene.cloths[0], model::skinOf(scene, scene.cloths[0]), collider.start, collider.jointsStart);
  for (std::size_t i = 0; i < places.size(); ++i)
    state.positions[i] = places[i].cast<float>() + (scene.cloths[0].skin->limits[i].followsExactly()
                                                        ? model::Vec3(model::Vec3::Zero())
                                                        : model::Vec3(off(random), off(random), off(random)));
  return state;
}

// Rounding of a position that several joints give, and that a limit moves: about thirty operations.
constexpr double kPlaceError = 30 * kRounding * 1.0;

TEST_F(ClothSkins, NodesMoveAsInTheReference) {
  model::Scene scene = sleeveScene(looseCloth(kRows, kColumns));
  scene.substeps = 4;
  const MovingCollider collider = bendingRodAt(scene, 1);
  const NodeState start = stateNear(scene, collider, 0.08f);
  Running running(scene);
  running.restore(start);
  const simulation::TickInputs inputs = inputsOf(scene, {collider});
  EXPECT_TRUE(running.tick(inputs).healthy);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputs));
  const NodeState after = running.state();
  // The large backstop multiplies an error of the normal by its radius, and its difference of squares keeps
  // one of about a rounding of the distance times the radius.
  const double distance = 4 * kPlaceError + 8 * kRounding * 40 * 0.1;
  EXPECT_LT(largestDistance(after, reference), distance);
  // An error of a direction is that of a place by the shortest limit, 1 cm, for speeds of about 3 m/s.
  EXPECT_LT(largestSpeedDifference(after, reference), 3 * distance / 0.01);
}

TEST_F(ClothSkins, NodesWithTheDistanceZeroAreWhereTheJointsTakeThem) {
  const model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  Running running(scene);
  running.restore(stateNear(scene, bendingRodAt(scene, 0), 0.005f));
  for (int tick = 0; tick < 20; ++tick) {
    running.tick(bendingInputs(scene, tick));
    const NodeState state = running.state();
    const std::vector<Eigen::Vector3d> places =
        placesAfter(scene, bendingRodAt(scene, static_cast<float>(tick)));
    for (std::size_t node = 0; node < kColumns; ++node)
      ASSERT_LT((state.positions[node].cast<double>() - places[node]).norm(),
                kPlaceError + scene.substeps * kRounding)
          << "node " << node << ", tick " << tick;
  }
}

// A wind that bends the cloth far, and joints that move.
TEST_F(ClothSkins, NoNodeLeavesItsDistanceNorEntersItsBackstop) {
  model::Cloth cloth = calmCloth(kRows, kColumns);
  cloth.drag = 2;
  model::Scene scene = sleeveScene(cloth);
  Running running(scene);
  running.restore(stateNear(scene, bendingRodAt(scene, 0), 0.005f));
  const std::vector<model::Vec3> normals = model::restNormals(scene.cloths[0]);
  std::size_t atDistance = 0, atBackstop = 0;
  double farthestFree = 0;
  for (int tick = 0; tick < 40; ++tick) {
    simulation::TickInputs inputs = bendingInputs(scene, tick);
    inputs.environment.wind = model::Vec3(0, 0, tick < 20 ? -8.0f : 8.0f);
    running.tick(inputs);
    const NodeState state = running.state();
    const MovingCollider collider = bendingRodAt(scene, static_cast<float>(tick));
    const std::vector<Eigen::Vector3d> places = placesAfter(scene, collider);
    const std::vector<model::Transform> joints =
        model::jointTransforms(model::skinOf(scene, scene.cloths[0]), collider.jointsEnd);
    for (std::size_t i = 0; i < places.size(); ++i) {
      const model::SkinLimits& limits = scene.cloths[0].skin->limits[i];
      const Eigen::Vector3d away = state.positions[i].cast<double>() - places[i];
      if (!limits.isBounded()) farthestFree = std::max(farthestFree, away.norm());
      if (limits.maxDistance < 1) {
        ASSERT_LT(away.norm(), double{limits.maxDistance} + kPlaceError) << "node " << i << ", tick " << tick;
        atDistance += away.norm() > 0.999 * double{limits.maxDistance};
      }
      if (limits.backstopRadius == 0) continue;
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      for (std::size_t k = 0; k < 2; ++k) {
        model::Transform turn = joints[scene.cloths[0].skin->joints[i].joints[k]];
        turn[3] = turn[7] = turn[11] = 0;
        normal += double{scene.cloths[0].skin->joints[i].weights[k]} *
                  model::transformed(turn, normals[i].cast<double>());
      }
      normal = (collider.end.orientation.cast<double>() * normal).normalized();
      const double radius = double{limits.backstopRadius};
      const double outside = (away + (double{limits.backstopDistance} + radius) * normal).norm() - radius;
      // Only the distance acts after the backstop, and may lead a little back into a small one.
      ASSERT_GT(outside, -(kPlaceError + 8 * kRounding * radius) - (radius < 1 ? 0.002 : 0))
          << "node " << i << ", tick " << tick;
      atBackstop += outside < 1e-4;
    }
  }
  EXPECT_GT(atDistance, 100u);
  EXPECT_GT(atBackstop, 100u);
  EXPECT_GT(farthestFree, 0.06);  // it would be beyond the distances of the others
}

TEST_F(ClothSkins, StartsWhereItsAnimationStarts) {
  model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  const model::Solid& rod = std::get<model::Solid>(scene.colliders[0].shape);
  model::ClosedMesh animated = *rod;
  std::vector<model::Pose> bent = model::restJoints(*rod->skin), straight = bent;
  bent[1].orientation = turned(60, model::Vec3::UnitZ());
  animated.skin->keys = {{0, bent}, {1, straight}, {2, bent}};
  scene.colliders[0].shape = std::make_shared<const model::ClosedMesh>(std::move(animated));
  scene.colliders[0].pose = {model::Vec3(0.3f, 0.2f, 0.1f), turned(30, model::Vec3::UnitY())};
  std::vector<model::Pose> joints;
  model::compose(model::skinOf(scene, scene.cloths[0]), bent, joints);
  const std::vector<Eigen::Vector3d> places = model::skinnedPlaces(
      scene.cloths[0], model::skinOf(scene, scene.cloths[0]), scene.colliders[0].pose, joints);
  const NodeState start = simulation::startState(scene, model::Vec3::Zero());
  for (std::size_t i = 0; i < places.size(); ++i)
    ASSERT_LT((start.positions[i].cast<double>() - places[i]).norm(), kRounding);
  EXPECT_GT((start.positions.back() - model::restPositions(scene.cloths[0]).back()).norm(), 0.1f);
}

TEST_F(ClothSkins, StartsWithTheVelocityOfItsAnimation) {
  model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  const model::Solid& rod = std::get<model::Solid>(scene.colliders[0].shape);
  model::ClosedMesh animated = *rod;
  std::vector<model::Pose> straight = model::restJoints(*rod->skin), bent = straight;
  bent[1].orientation = turned(60, model::Vec3::UnitZ());
  animated.skin->keys = {{0, straight}, {1, bent}, {2, straight}};
  scene.colliders[0].shape = std::make_shared<const model::ClosedMesh>(std::move(animated));
  const MovingCollider collider = simulation::inputsAt(scene, 0).colliders[0];
  const std::vector<Eigen::Vector3d> places = placesAfter(scene, collider);
  const NodeState start = simulation::startState(scene, model::Vec3::Zero());
  for (std::size_t i = 0; i < places.size(); ++i) {
    Eigen::Vector3d velocity = (places[i] - start.positions[i].cast<double>()) * scene.simulationRate;
    if (scene.cloths[0].skin->limits[i].followsExactly()) velocity.setZero();
    ASSERT_LT((start.velocities[i].cast<double>() - velocity).norm(), kPlaceError * scene.simulationRate)
        << "node " << i;
  }
  // The elbow turns by a radian in a second, and the last node is 16 cm away.
  EXPECT_GT(start.velocities.back().norm(), 0.1f);
}

// Gravity is along the axis of the turn, so the motion after the jump is that without it, moved.
TEST_F(ClothSkins, AJumpTakesTheClothAlongAsARigidBody) {
  const model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  const model::Pose jump{model::Vec3(2, 0.5f, -1), turned(170, model::Vec3::UnitY())};
  const auto moved = [&](const model::Pose& pose) {
    return model::Pose{jump.position + jump.orientation * pose.position,
                       (jump.orientation * pose.orientation).normalized()};
  };
  Running still(scene), jumping(scene);
  for (Running* running : {&still, &jumping})
    running->restore(stateNear(scene, bendingRodAt(scene, 0), 0.005f));
  for (int tick = 0; tick < 12; ++tick) {
    MovingCollider collider = bendingRodAt(scene, static_cast<float>(tick));
    still.tick(inputsOf(scene, {collider}));
    if (tick == 6) {
      collider.jumped = true;
      collider.before = collider.start;
      collider.jointsBefore = collider.jointsStart;
    }
    if (tick >= 6)
      for (model::Pose* pose : {&collider.start, &collider.end}) *pose = moved(*pose);
    jumping.tick(inputsOf(scene, {collider}));
  }
  const NodeState expected = still.state(), after = jumping.state();
  for (std::size_t i = 0; i < expected.positions.size(); ++i) {
    const model::Vec3 place = jump.position + jump.orientation * expected.positions[i];
    // Springs at a tenth of their stability bound do not make errors of rounding grow in six ticks.
    ASSERT_LT((after.positions[i] - place).norm(), 1e-5f) << "node " << i;
    ASSERT_LT((after.velocities[i] - jump.orientation * expected.velocities[i]).norm(), 1e-3f);
  }
}

// The elbow goes from straight to bent between two ticks.
TEST_F(ClothSkins, AHardCutOfTheJointsIsAsInTheReference) {
  model::Scene scene = sleeveScene(looseCloth(kRows, kColumns));
  scene.substeps = 2;
  MovingCollider collider = bendingRodAt(scene, 2);
  const NodeState start = stateNear(scene, collider, 0.03f);
  const auto& rod = std::get<model::Solid>(scene.colliders[0].shape);
  collider.jumped = true;
  collider.before = collider.start;
  collider.jointsBefore = std::exchange(collider.jointsStart, elbowAt(rod, 130));
  collider.jointsEnd = elbowAt(rod, 132);
  Running running(scene);
  running.restore(start);
  const simulation::TickInputs inputs = inputsOf(scene, {collider});
  running.tick(inputs);
  reference::ReferenceSimulation reference(scene);
  setState(reference, start);
  reference.tick(referenceInputs(inputs));
  EXPECT_LT(largestDistance(running.state(), reference), 4 * kPlaceError + 8 * kRounding * 40 * 0.1);
}

TEST_F(ClothSkins, AJumpIsFoundByItsSpeed) {
  const model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  const double tick = 1.0 / 72;
  MovingCollider slow = bendingRodAt(scene, 0), far = slow, bent = slow;
  simulation::jump(slow, tick);
  EXPECT_FALSE(slow.jumped);
  far.end.position.x() += 0.5f;  // 36 m/s
  const model::Pose before = far.start;
  simulation::jump(far, tick);
  EXPECT_TRUE(far.jumped);
  EXPECT_EQ(far.before.position, before.position);
  EXPECT_EQ(far.start.position, far.end.position);
  bent.jointsEnd = elbowAt(std::get<model::Solid>(scene.colliders[0].shape), 170);
  simulation::jump(bent, tick);
  EXPECT_TRUE(bent.jumped);
  EXPECT_EQ(bent.jointsStart[1].orientation.coeffs(), bent.jointsEnd[1].orientation.coeffs());
  EXPECT_NE(bent.jointsBefore[1].orientation.coeffs(), bent.jointsEnd[1].orientation.coeffs());
}

TEST_F(ClothSkins, FarFromTheOriginTheMotionIsTheSame) {
  const auto run = [](const model::Vec3& place) {
    const model::Scene scene =
        sleeveScene(calmCloth(kRows, kColumns), {place, model::Quaternion::Identity()});
    Running running(scene);
    for (int tick = 0; tick < 10; ++tick) {
      MovingCollider collider{scene.colliders[0].shape, scene.colliders[0].pose, scene.colliders[0].pose, 1};
      collider.jointsStart = elbowAt(std::get<model::Solid>(collider.shape), 3 * static_cast<float>(tick));
      collider.jointsEnd = elbowAt(std::get<model::Solid>(collider.shape), 3 * static_cast<float>(tick + 1));
      running.tick(inputsOf(scene, {collider}));
    }
    return running.save();
  };
  const simulation::StateSnapshot near = run(model::Vec3::Zero()), far = run(model::Vec3(640, -128, 64));
  EXPECT_EQ(far.origin, model::Vec3(640, -128, 64));
  EXPECT_EQ(near.bytes, far.bytes);
}

TEST_F(ClothSkins, JointsOfAColliderThatATickLacksRest) {
  const model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  Running without(scene), with(scene);
  without.tick(inputsOf(scene));
  with.tick(inputsOf(scene, {{scene.colliders[0].shape, {}, {}, 1}}));
  EXPECT_EQ(without.save().bytes, with.save().bytes);
}

TEST_F(ClothSkins, GivesTheSameBitsForEveryPartitionOfTheWork) {
  const model::Scene scene = sleeveScene(calmCloth(kRows, kColumns));
  const simulation::SimulationOptions ways[] = {{.workgroupSize = 32}, {.workgroupSize = 128}};
  expectSameBits(scene, bendingInputs, 30, ways);
}

}  // namespace
}  // namespace clothstream::tests
