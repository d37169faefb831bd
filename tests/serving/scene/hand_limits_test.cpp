// SPDX-License-Identifier: MIT
// Bounds on the energy that participants give to cloth.
#include "server/scene/hand_limits.h"

#include <cmath>
#include <memory>
#include <variant>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/scene/collider_set.h"
#include "server/scene/grabs_and_attachments.h"
#include "server/scene/joint_follower.h"
#include "tests/model/solids.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using model::Vec3;
using simulation::MovingCollider;
using ::testing::Each;
using ::testing::ElementsAre;
using tests::handAt;
using tests::smallScene;

constexpr float kTick = 1.0f / 40;  // s, of smallScene()

class HandLimits : public ::testing::Test {
 protected:
  // Places one collider of participant 7, and returns it in the next tick.
  const MovingCollider& place(const model::ParticipantCollider& collider) {
    colliders.place(7, std::vector{collider});
    colliders.advance(scene, ++tick * scene.tickSeconds(), moving);
    return moving.back();
  }
  static float radiusOf(const MovingCollider& collider) {
    return std::get<model::Sphere>(collider.shape).radius;
  }
  model::Scene scene = smallScene();
  ColliderSet colliders{scene};
  std::vector<MovingCollider> moving;
  int tick = 0;
};

TEST_F(HandLimits, ALargeColliderGrowsWhereItAppears) {
  model::ParticipantCollider ball = handAt(1, 0);
  ball.shape = model::Sphere{2};
  EXPECT_EQ(radiusOf(place(ball)), kMaxAppearance);
  EXPECT_EQ(radiusOf(place(ball)), kMaxAppearance + kGrowth * kTick);
  for (int i = 0; i < 40; ++i) place(ball);
  EXPECT_EQ(radiusOf(moving.back()), 2);
  ball.pose.position.x() = 5;  // a jump
  EXPECT_EQ(radiusOf(place(ball)), kMaxAppearance);
  EXPECT_EQ(moving.back().start.position.x(), 5);
  v1::Frame frame;
  colliders.write(scene, frame);
  EXPECT_EQ(frame.colliders(1).sphere().radius(), kMaxAppearance);
  ball.shape = model::Sphere{0.1f};
  EXPECT_EQ(radiusOf(place(ball)), 0.1f);
  ball.shape = model::Sphere{10};
  EXPECT_EQ(radiusOf(place(ball)), 0.1f + kGrowth * kTick);
}

TEST_F(HandLimits, HandsAndHeadsAppearWholeAndBodiesSoon) {
  model::ParticipantCollider collider = handAt(1, 0);
  for (const model::Shape& shape :
       {model::Shape(model::Sphere{0.1f}), model::Shape(model::Capsule{.radius = 0.02f, .length = 0.1f}),
        model::Shape(model::Box{Vec3(0.5f, 1.8f, 0.3f)}),
        model::Shape(model::Capsule{.radius = 0.25f, .length = 1.2f})}) {
    collider.shape = shape;
    ++collider.id;
    place(collider);
    for (int i = 0; i < 3 && model::largestDepth(shape) > kMaxAppearance; ++i) place(collider);
    EXPECT_EQ(model::largestDepth(moving.back().shape), model::largestDepth(shape));
    EXPECT_EQ(model::reachOf(moving.back().shape), model::reachOf(shape));
  }
}

TEST_F(HandLimits, ABoxIsThinnedAlongItsThinnestSide) {
  const model::Shape thin = model::thinned(model::Box{Vec3(3, 1, 2)}, 0.25f);
  EXPECT_EQ(std::get<model::Box>(thin).size, Vec3(3, 0.5f, 2));
}

TEST_F(HandLimits, AFastTurnOfALongColliderIsAJump) {
  model::ParticipantCollider stick = handAt(1, 0);
  stick.shape = model::Box{Vec3(10, 0.1f, 0.1f)};
  place(stick);
  stick.pose.orientation = model::Quaternion(Eigen::AngleAxisf(0.2f, Vec3::UnitY()));
  EXPECT_EQ(place(stick).start.orientation.coeffs(), model::Quaternion::Identity().coeffs());
  stick.pose.orientation = model::Quaternion(Eigen::AngleAxisf(1, Vec3::UnitY()));
  EXPECT_EQ(place(stick).start.orientation.coeffs(), stick.pose.orientation.coeffs());
}

TEST_F(HandLimits, AGrabFollowsAtTheSpeedOfAHandWithABoundedForce) {
  GrabsAndAttachments grabs(scene);
  simulation::TickInputs inputs;
  const auto grabAt = [&](float x, float force) {
    const model::Grab grab{.id = 1,
                           .pose = {Vec3(x, 0, 0), model::Quaternion::Identity()},
                           .maxForce = force,
                           .slipDistance = 10};
    grabs.place(7, std::vector{grab}, {});
    grabs.advance(scene, ++tick * scene.tickSeconds(), inputs);
    return inputs.grabs.at(0);
  };
  EXPECT_EQ(grabAt(0, 20).maxForce, 20);
  const float most = maxGrabForce(scene);
  EXPECT_FLOAT_EQ(most, 0.12f * kMaxHandSpeed / kPullSeconds);
  EXPECT_EQ(grabAt(0.5f, 1e6f).maxForce, most);
  EXPECT_EQ(inputs.grabs[0].end.position.x(), 0.5f);
  EXPECT_FLOAT_EQ(grabAt(9, 20).end.position.x(), 0.5f + kMaxHandSpeed * kTick);
  EXPECT_EQ(inputs.grabs[0].start.position.x(), 0.5f);
  EXPECT_FLOAT_EQ(grabAt(9, 20).start.position.x(), 0.5f + kMaxHandSpeed * kTick);
}

TEST_F(HandLimits, GrabsShareTheForceOfOne) {
  scene.cloths[0].mass = 1;
  GrabsAndAttachments grabs(scene);
  simulation::TickInputs inputs;
  const auto forcesOf = [&](std::vector<float> wanted) {
    std::vector<model::Grab> all;
    for (const float force : wanted)
      all.push_back({.id = static_cast<std::uint32_t>(all.size() + 1), .maxForce = force});
    grabs.place(7, all, {});
    grabs.advance(scene, ++tick * scene.tickSeconds(), inputs);
    std::vector<float> given;
    for (const simulation::Grab& grab : inputs.grabs) given.push_back(grab.maxForce);
    return given;
  };
  EXPECT_EQ(maxGrabForce(scene), 300);
  EXPECT_THAT(forcesOf({100, 100, 100}), ElementsAre(100, 100, 100));
  EXPECT_THAT(forcesOf({100, 1e6f, 1e6f}), ElementsAre(100, 100, 100));
  EXPECT_THAT(forcesOf({20, 1e6f, 1e6f}), ElementsAre(20, 140, 140)) << "one that needs less leaves the rest";
  EXPECT_THAT(forcesOf(std::vector<float>(20, 1e6f)), Each(kLeastMaxForce))
      << "as much as every grab may have";
}

TEST_F(HandLimits, LightClothMayBeHeldAsBefore) {
  scene.cloths[0].mass = 0.001f;
  EXPECT_EQ(maxGrabForce(scene), kLeastMaxForce);
}

// An arm of one metre that a joint turns.
class JointSpeed : public ::testing::Test {
 protected:
  static model::Solid arm() {
    model::ClosedMesh mesh = *model::boxMesh(Vec3(0.1f, 2, 0.1f));
    model::Skin skin;
    skin.joints.push_back({"shoulder", std::nullopt, {}});
    skin.vertices.resize(mesh.vertices.size(), {.joints = {}, .weights = {1, 0, 0, 0}});
    mesh.skin = skin;
    return std::make_shared<const model::ClosedMesh>(std::move(mesh));
  }
  static model::Pose turned(float radians) {
    return {Vec3::Zero(), model::Quaternion(Eigen::AngleAxisf(radians, Vec3::UnitX()))};
  }
  static float angleOf(const model::Pose& pose) {
    return pose.orientation.angularDistance(model::Quaternion::Identity());
  }
  JointFollower follower{arm()};
  std::vector<model::Pose> end;
};

TEST_F(JointSpeed, ASlowMotionReachesItsPoseExactly) {
  const std::vector<model::Pose> now{turned(0)}, target{turned(0.1f)};
  follower.follow(now, target, 0.2f, end);
  EXPECT_EQ(end[0].orientation.coeffs(), target[0].orientation.coeffs());
}

TEST_F(JointSpeed, NoVertexIsFasterThanABody) {
  std::vector<model::Pose> now{turned(0)};
  const std::vector<model::Pose> target{turned(2)};
  int ticks = 0;
  for (; angleOf(now[0]) < 1.999f && ticks < 100; ++ticks) {
    follower.follow(now, target, 0.2f, end);
    EXPECT_LT(end[0].orientation.angularDistance(now[0].orientation), 0.21f) << "the hand is 1 m away";
    EXPECT_GT(angleOf(end[0]), angleOf(now[0]));
    now = end;
  }
  EXPECT_LE(ticks, 12);
}

TEST_F(JointSpeed, ToAndFroStaysSlow) {
  std::vector<model::Pose> now{turned(0)};
  for (int tick = 0; tick < 20; ++tick) {
    const std::vector<model::Pose> target{turned(tick % 2 == 0 ? 2.0f : -2.0f)};
    follower.follow(now, target, 0.2f, end);
    EXPECT_LT(end[0].orientation.angularDistance(now[0].orientation), 0.21f);
    now = end;
  }
}

}  // namespace
}  // namespace clothstream::scene
