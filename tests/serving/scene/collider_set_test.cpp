// SPDX-License-Identifier: MIT
// Colliders from tick to tick, and in frames whose memory is reused.
#include "server/scene/collider_set.h"

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "tests/model/solids.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

TEST(ColliderSet, WritesTheSameIntoUsedFrames) {
  model::Scene scene = tests::smallScene();
  scene.colliders.emplace_back().name = "post";
  scene.colliders.back().shape = model::Capsule{.radius = 0.1f, .length = 1, .topRadius = 0.05f};
  ColliderSet set(scene);
  std::vector<simulation::MovingCollider> moving;
  v1::Frame used;
  double seconds = 0;
  const auto place = [&](const std::vector<model::Shape>& shapes) {
    std::vector<model::ParticipantCollider> colliders;
    for (const model::Shape& shape : shapes) {
      colliders.push_back(tests::handAt(static_cast<std::uint32_t>(colliders.size()), 0.1f));
      colliders.back().shape = shape;
    }
    set.place(7, colliders);
    set.advance(scene, seconds += scene.tickSeconds(), moving);
    v1::Frame fresh;
    set.write(scene, fresh);
    set.write(scene, used);
    EXPECT_EQ(used.colliders_size(), static_cast<int>(2 + shapes.size()));
    EXPECT_EQ(used.SerializeAsString(), fresh.SerializeAsString());
  };
  const model::Capsule tapered{.radius = 0.1f, .length = 0.2f, .topRadius = 0.05f}, even{.radius = 0.1f};
  place({tapered, model::Sphere{0.1f}, model::Box{model::Vec3(0.1f, 0.2f, 0.3f)}});
  place({even, model::Box{model::Vec3(0.3f, 0.2f, 0.1f)}});
  place({model::Sphere{0.2f}, tapered, tapered, even});
  place({});
  place({even});
}

// A rod of two joints; the second one turns.
model::Scene sceneWithRod() {
  model::Scene scene = tests::smallScene();
  model::ClosedMesh rod = *model::rodMesh(0.03f, 0.4f, 4, 4);
  model::Skin skin{.joints = {{"root", std::nullopt, {}}, {"elbow", 0, {}}}, .vertices = {}, .keys = {}};
  for (const model::Vec3& vertex : rod.vertices)
    skin.vertices.push_back({{vertex.x() > 0 ? std::uint8_t{1} : std::uint8_t{0}, 0, 0, 0}, {1, 0, 0, 0}});
  rod.skin = skin;
  scene.colliders.push_back({.name = "rod", .shape = std::make_shared<const model::ClosedMesh>(rod)});
  return scene;
}

TEST(ColliderSet, JointsThatAParticipantMovesFollowAtTheSpeedOfABodyOrJump) {
  const model::Scene scene = sceneWithRod();
  const std::size_t rod = scene.colliders.size() - 1;
  std::vector<model::Pose> turned =
      model::restJoints(*std::get<model::Solid>(scene.colliders[rod].shape)->skin);
  turned[1].orientation = model::Quaternion(0, 0, 0, 1);  // half a turn
  const auto movedTo = [&](bool jumps) {
    ColliderSet set(scene);
    set.placeJoints(std::vector{model::ColliderJoints{rod, turned, jumps}});
    std::vector<simulation::MovingCollider> moving;
    set.advance(scene, scene.tickSeconds(), moving);
    return moving[rod];
  };
  const simulation::MovingCollider follows = movedTo(false), jumps = movedTo(true);
  EXPECT_FALSE(follows.jumped);
  EXPECT_GT(std::abs(follows.jointsEnd[1].orientation.w()), 0.5f);  // less than 120 degrees
  EXPECT_TRUE(jumps.jumped);
  EXPECT_EQ(jumps.jointsBefore[1].orientation.w(), 1);
  EXPECT_EQ(jumps.jointsStart[1].orientation.w(), 0);
  EXPECT_EQ(jumps.jointsEnd[1].orientation.w(), 0);
}

TEST(ColliderSet, JointsJumpOnce) {
  const model::Scene scene = sceneWithRod();
  const std::size_t rod = scene.colliders.size() - 1;
  std::vector<model::Pose> poses =
      model::restJoints(*std::get<model::Solid>(scene.colliders[rod].shape)->skin);
  ColliderSet set(scene);
  std::vector<simulation::MovingCollider> moving;
  set.placeJoints(std::vector{model::ColliderJoints{rod, poses, true}});
  set.advance(scene, scene.tickSeconds(), moving);
  EXPECT_TRUE(moving[rod].jumped);
  set.advance(scene, 2 * scene.tickSeconds(), moving);
  EXPECT_FALSE(moving[rod].jumped);
}

TEST(ColliderSet, ClothThatWentBackComesAlongOnce) {
  const model::Scene scene = sceneWithRod();
  const std::size_t rod = scene.colliders.size() - 1;
  std::vector<model::Pose> turned =
      model::restJoints(*std::get<model::Solid>(scene.colliders[rod].shape)->skin);
  turned[1].orientation = model::Quaternion(0, 0, 0, 1);  // half a turn
  ColliderSet set(scene);
  std::vector<simulation::MovingCollider> moving;
  auto advance = [&, tick = 0]() mutable { set.advance(scene, ++tick * scene.tickSeconds(), moving); };
  set.placeJoints(std::vector{model::ColliderJoints{rod, turned, true}});
  advance();
  set.clothsWentBack(set.followedAtStart());
  advance();
  EXPECT_TRUE(moving[rod].jumped);
  EXPECT_EQ(moving[rod].jointsBefore[1].orientation.w(), 1);
  EXPECT_EQ(moving[rod].jointsStart[1].orientation.w(), 0);
  advance();
  EXPECT_FALSE(moving[rod].jumped);
  // The joints have not moved since this state, so that not even rounding moves the cloth.
  set.keepFollowed();
  set.clothsWentBack();
  advance();
  EXPECT_FALSE(moving[rod].jumped);
}

}  // namespace
}  // namespace clothstream::scene
