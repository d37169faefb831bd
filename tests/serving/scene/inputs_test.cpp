// SPDX-License-Identifier: MIT
// Path from a participant's message to the colliders of a tick.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/scene/collider_set.h"
#include "server/scene/grabs_and_attachments.h"
#include "server/scene/inbox.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using namespace schedule;

using model::Vec3;
using simulation::MovingCollider;
using tests::gravity;
using tests::handAt;

model::Scene sceneWithBall() {
  model::Scene scene;
  scene.simulationRate = scene.streamRate = 100;
  model::Collider ball;
  ball.name = "ball";
  ball.shape = model::Sphere{0.3f};
  ball.pose.position = Vec3(0, 1, 0);
  scene.colliders = {ball};
  return scene;
}

// A rod with its own motion, and one attached to the ball.
model::Scene sceneWithAttachments() {
  model::Scene scene = sceneWithBall();
  model::Cloth& cloth = scene.cloths.emplace_back();
  cloth.grid.rows = cloth.grid.columns = 3;
  model::Attachment rod;
  rod.name = "rod";
  rod.ranges = {{}};
  rod.motion = {.keys = {{.time = 0}, {.time = 1, .position = Vec3(1, 0, 0)}}, .steady = true};
  model::Attachment knot;
  knot.name = "knot";
  knot.vertices = {8};
  knot.collider = "ball";
  cloth.attachments = {rod, knot};
  return scene;
}

class ColliderSetTest : public ::testing::Test {
 protected:
  const std::vector<MovingCollider>& advance() {
    colliders.advance(scene, ++tick * scene.tickSeconds(), moving);
    return moving;
  }
  model::Scene scene = sceneWithBall();
  ColliderSet colliders{scene};
  std::vector<MovingCollider> moving;
  int tick = 0;
};

TEST_F(ColliderSetTest, ColliderAppearsAtRestAndMovesInAStraightLine) {
  colliders.place(7, std::vector{handAt(1, 0.5f)});
  ASSERT_EQ(advance().size(), 2u);
  EXPECT_EQ(moving[1].start.position, Vec3(0.5f, 0, 0));
  EXPECT_EQ(moving[1].end.position, Vec3(0.5f, 0, 0));
  colliders.place(7, std::vector{handAt(1, 0.6f)});
  advance();
  EXPECT_EQ(moving[1].start.position, Vec3(0.5f, 0, 0));
  EXPECT_EQ(moving[1].end.position, Vec3(0.6f, 0, 0));
  advance();  // without a new pose the collider rests
  EXPECT_EQ(moving[1].start.position, Vec3(0.6f, 0, 0));
  EXPECT_EQ(moving[1].end.position, Vec3(0.6f, 0, 0));
}

TEST_F(ColliderSetTest, JumpIsNotSwept) {
  colliders.place(7, std::vector{handAt(1, 0)});
  advance();
  // A faster motion than 30 m/s is a jump: 0.3 m in a tick of 10 ms.
  colliders.place(7, std::vector{handAt(1, 0.31f)});
  EXPECT_EQ(advance()[1].start.position, Vec3(0.31f, 0, 0));
  colliders.place(7, std::vector{handAt(1, 0.6f)});
  EXPECT_EQ(advance()[1].start.position, Vec3(0.31f, 0, 0));
}

TEST_F(ColliderSetTest, RotationIsSweptUnlessItIsAJump) {
  model::ParticipantCollider finger = handAt(1, 0);
  finger.shape = model::Capsule{.radius = 0.01f, .length = 0.03f};
  colliders.place(7, std::vector{finger});
  advance();
  const auto turned = [&](float degrees) {
    finger.pose.orientation =
        model::Quaternion(Eigen::AngleAxisf(degrees * std::acos(-1.0f) / 180, Vec3::UnitZ()));
    colliders.place(7, std::vector{finger});
    return advance()[1];
  };
  const MovingCollider some = turned(100);
  EXPECT_EQ(std::get<model::Capsule>(some.shape).length, 0.03f);
  EXPECT_EQ(some.start.orientation.coeffs(), model::Quaternion::Identity().coeffs());
  EXPECT_EQ(some.end.orientation.coeffs(), finger.pose.orientation.coeffs());
  const MovingCollider jump = turned(-130);
  EXPECT_EQ(jump.start.orientation.coeffs(), finger.pose.orientation.coeffs());
}

// Cloth is held behind x = 1: it is as deep inside a collider as that is beyond.
TEST_F(ColliderSetTest, ColliderYieldsWhereClothHasNoRoom) {
  v1::Frame frame;
  const auto move = [&](float x) {
    colliders.place(7, std::vector{handAt(1, x)});
    advance();
    colliders.settle(std::vector{0.0f, std::max(moving[1].end.position.x() - 1, 0.0f)});
    colliders.write(scene, frame);
    EXPECT_EQ(frame.colliders(1).position().x(), moving[1].end.position.x());
    return moving[1].end.position.x();
  };
  for (const float x : {0.7f, 0.8f, 0.9f, 1.0f}) {
    EXPECT_EQ(move(x), x);
    EXPECT_FALSE(frame.colliders(1).yields());
  }
  for (int i = 0; i < 40; ++i) EXPECT_LE(move(1.1f), 1.1f);
  for (int i = 0; i < 40; ++i) {
    EXPECT_NEAR(move(1.1f), 1, 0.008);
    EXPECT_TRUE(frame.colliders(1).yields());
  }
  for (int i = 0; i < 20; ++i) move(0.8f);
  EXPECT_EQ(move(0.8f), 0.8f);
  EXPECT_FALSE(frame.colliders(1).yields());
  EXPECT_EQ(move(0.5f), 0.5f);
}

// Cloth that another body presses into a collider, or in which it appeared, lets it go out and not farther
// in.
TEST_F(ColliderSetTest, ColliderLeavesClothThatIsInsideIt) {
  const auto move = [&](float x) {
    colliders.place(7, std::vector{handAt(1, x)});
    advance();
    colliders.settle(std::vector{0.0f, std::max(moving[1].end.position.x() - 1, 0.0f)});
    return moving[1].end.position.x();
  };
  EXPECT_EQ(move(1.02f), 1.02f);
  for (int i = 0; i < 40; ++i) EXPECT_NEAR(move(1.1f), 1.02, 0.0011);
  for (int i = 0; i < 40; ++i) move(0.9f);
  EXPECT_EQ(move(0.9f), 0.9f);
}

TEST_F(ColliderSetTest, MissingColliderIsRemoved) {
  colliders.place(7, std::vector{handAt(1, 0), handAt(2, 1)});
  colliders.place(8, std::vector{handAt(1, 2)});
  EXPECT_EQ(advance().size(), 4u);
  colliders.place(7, std::vector{handAt(2, 1)});
  ASSERT_EQ(advance().size(), 3u);
  EXPECT_EQ(moving[1].end.position.x(), 1);
  EXPECT_EQ(moving[2].end.position.x(), 2);
  colliders.place(8, {});
  EXPECT_EQ(advance().size(), 2u);
}

TEST_F(ColliderSetTest, OrderDoesNotDependOnArrival) {
  colliders.place(9, std::vector{handAt(5, 95), handAt(2, 92)});
  colliders.place(3, std::vector{handAt(4, 34)});
  std::vector<float> xs;
  for (const MovingCollider& collider : advance()) xs.push_back(collider.end.position.x());
  EXPECT_THAT(xs, testing::ElementsAre(0, 34, 92, 95));
}

TEST_F(ColliderSetTest, SceneColliderFollowsItsMotionUntilMoved) {
  scene.colliders[0].motion.keys = {{0, Vec3(0, 1, 0)}, {1, Vec3(0, 1, 2)}, {2, Vec3(0, 1, 0)}};
  colliders = ColliderSet(scene);
  for (int i = 0; i < 100; ++i) advance();
  EXPECT_EQ(moving[0].end.position, Vec3(0, 1, 2));
  EXPECT_LT(moving[0].start.position.z(), 2);
  model::ParameterChange change;
  change.colliders = {{.name = "ball", .position = Vec3(0, 1, 1.9f), .radius = 0.5f}};
  model::applyChange(scene, change);
  advance();
  EXPECT_EQ(moving[0].start.position, Vec3(0, 1, 2));
  EXPECT_EQ(moving[0].end.position, Vec3(0, 1, 1.9f));
  EXPECT_EQ(std::get<model::Sphere>(moving[0].shape).radius, 0.5f);
}

TEST_F(ColliderSetTest, WritesAllCollidersWithTheirParticipant) {
  colliders.place(7, std::vector{handAt(1, 0.5f)});
  advance();
  v1::Frame frame;
  colliders.write(scene, frame);
  const auto& states = frame.colliders();
  ASSERT_EQ(states.size(), 2);
  EXPECT_EQ(states[0].name(), "ball");
  EXPECT_EQ(states[0].participant_id(), 0u);
  EXPECT_EQ(states[0].position().y(), 1);
  EXPECT_EQ(states[1].participant_id(), 7u);
  EXPECT_EQ(states[1].position().x(), 0.5f);
}

// Attachments stay at their pose: a message without an attachment does not undo an earlier one.
TEST(Inbox, KeepsAttachmentPoses) {
  Inbox inbox;
  const auto put = [](std::size_t attachment, float x) {
    return model::AttachmentPose{attachment, {Vec3(x, 0, 0), model::Quaternion::Identity()}};
  };
  inbox.postPoses(1, {.attachments = {put(0, 1), put(1, 2)}}, Clock::now());
  inbox.postPoses(1, {.colliders = {handAt(1, 0)}, .attachments = {put(0, 3)}}, Clock::now());
  Inputs inputs;
  inbox.drain(inputs);
  ASSERT_EQ(inputs.poses.size(), 1u);
  const model::Scene scene = sceneWithAttachments();
  GrabsAndAttachments holds(scene);
  holds.place(1, inputs.poses[0].now.poses.grabs, inputs.poses[0].now.poses.attachments);
  simulation::TickInputs tick;
  holds.advance(scene, 0.01, tick);
  ASSERT_EQ(tick.attachments.size(), 2u);
  EXPECT_EQ(tick.attachments[0].position.x(), 3);
  EXPECT_EQ(tick.attachments[1].position.x(), 2);
}

TEST(GrabsAndAttachments, AttachmentFollowsItsMotionUntilMoved) {
  model::Scene scene = sceneWithAttachments();
  GrabsAndAttachments holds(scene);
  simulation::TickInputs tick;
  holds.advance(scene, 0.25, tick);
  EXPECT_EQ(tick.attachments[0].position, Vec3(0.25f, 0, 0));
  EXPECT_EQ(tick.attachments[1].position, Vec3(0, 1, 0));
  scene.colliders[0].pose.position = Vec3(0, 2, 0);
  holds.place(7, {}, std::vector{model::AttachmentPose{0, {Vec3(5, 5, 5), model::Quaternion::Identity()}}});
  for (const double seconds : {0.5, 0.75}) {
    holds.advance(scene, seconds, tick);
    EXPECT_EQ(tick.attachments[0].position, Vec3(5, 5, 5));
    EXPECT_EQ(tick.attachments[1].position, Vec3(0, 2, 0));
  }
}

// The cloth of the rod alone.
model::Scene sceneWithRod() {
  model::Scene scene = sceneWithAttachments();
  scene.cloths.back().attachments.pop_back();
  return scene;
}

TEST(GrabsAndAttachments, AJumpCarriesTheClothAlong) {
  const model::Scene scene = sceneWithRod();
  GrabsAndAttachments holds(scene);
  simulation::TickInputs tick;
  const auto put = [&](float x) {
    holds.place(7, {}, std::vector{model::AttachmentPose{0, {Vec3(x, 0, 0), model::Quaternion::Identity()}}});
    holds.advance(scene, 0.01, tick);
  };
  put(0.2f);
  EXPECT_TRUE(tick.carries.empty());
  put(5);
  ASSERT_EQ(tick.carries.size(), 1u);
  EXPECT_EQ(tick.carries[0].cloth, 0u);
  EXPECT_EQ(tick.carries[0].from.position, Vec3(0.2f, 0, 0));
  EXPECT_EQ(tick.carries[0].to.position, Vec3(5, 0, 0));
  put(5.1f);
  EXPECT_TRUE(tick.carries.empty());
}

TEST(GrabsAndAttachments, AShortJumpOnRequest) {
  const model::Scene scene = sceneWithRod();
  GrabsAndAttachments holds(scene);
  simulation::TickInputs tick;
  const auto put = [&](float x, bool jumps) {
    const model::Pose pose{Vec3(x, 0, 0), model::Quaternion::Identity()};
    holds.place(7, {}, std::vector{model::AttachmentPose{0, pose, jumps}});
    holds.advance(scene, 0.01, tick);
  };
  put(0.1f, true);
  ASSERT_EQ(tick.carries.size(), 1u);
  EXPECT_EQ(tick.carries[0].from.position, Vec3(0, 0, 0));
  EXPECT_EQ(tick.carries[0].to.position, Vec3(0.1f, 0, 0));
  put(0.2f, false);
  EXPECT_TRUE(tick.carries.empty());
}

// After a reset the cloth is at the rod's first place.
TEST(GrabsAndAttachments, AResetClothGoesToItsAttachments) {
  const model::Scene scene = sceneWithRod();
  GrabsAndAttachments holds(scene);
  simulation::TickInputs tick;
  holds.place(7, {}, std::vector{model::AttachmentPose{0, {Vec3(5, 0, 0), model::Quaternion::Identity()}}});
  for (int i = 0; i < 2; ++i) holds.advance(scene, 0.01, tick);
  EXPECT_TRUE(tick.carries.empty());
  holds.clothsWentBack(scene, true);
  holds.advance(scene, 0.01, tick);
  ASSERT_EQ(tick.carries.size(), 1u);
  EXPECT_EQ(tick.carries[0].from.position, Vec3(0, 0, 0));
  EXPECT_EQ(tick.carries[0].to.position, Vec3(5, 0, 0));
  // Where an earlier state has the cloth is not known: it catches up.
  holds.clothsWentBack(scene, false);
  holds.place(7, {}, std::vector{model::AttachmentPose{0, {Vec3(9, 0, 0), model::Quaternion::Identity()}}});
  holds.advance(scene, 0.01, tick);
  EXPECT_TRUE(tick.carries.empty());
}

// Three grabs hold in the snapshot. Since then the first went on, the second ended and its place went to
// another one, and the third ended.
TEST(GrabsAndAttachments, GrabsThatStillHoldAfterGoingBackKeepWhatTheyHeld) {
  using State = simulation::Grab::State;
  const model::Scene scene = sceneWithBall();
  GrabsAndAttachments grabs(scene);
  simulation::TickInputs tick;
  const auto grabOf = [](std::uint32_t id) {
    return std::vector{model::Grab{.id = id, .pose = {Vec3(0, 0, 0), model::Quaternion::Identity()}}};
  };
  for (const std::uint64_t participant : {7u, 8u, 9u}) grabs.place(participant, grabOf(1), {});
  grabs.advance(scene, 0.01, tick);
  const std::vector<GrabsAndAttachments::Slot> then = grabs.state().slots;
  simulation::HeldNodes held{
      .nodes = {{.node = 2, .grab = 0}, {.node = 3, .grab = 1}, {.node = 5, .grab = 2}},
      .grabs = {{1, 0}, {1, 0}, {1, 0}}};
  for (const std::uint64_t participant : {8u, 9u}) grabs.place(participant, {}, {});
  grabs.advance(scene, 0.02, tick);
  grabs.place(8, grabOf(1), {});
  grabs.advance(scene, 0.03, tick);
  grabs.goBack(then, held);
  ASSERT_EQ(held.nodes.size(), 1u);
  EXPECT_EQ(held.nodes[0].node, 2u);
  EXPECT_EQ(held.grabs.size(), 3u);
  grabs.advance(scene, 0.04, tick);
  ASSERT_EQ(tick.grabs.size(), 2u);
  EXPECT_EQ(tick.grabs[0].state, State::holds);
  EXPECT_EQ(tick.grabs[1].state, State::takes);
}

TEST(GrabsAndAttachments, AGrabThatGoesBackDrawsItsPlaceFromThereOn) {
  const model::Scene scene = sceneWithAttachments();
  GrabsAndAttachments grabs(scene);
  simulation::TickInputs tick;
  const model::Grab grab{.id = 1, .place = model::GrabPlace{.point = {.triangle = 1}}};
  grabs.place(7, std::vector{grab}, {});
  grabs.advance(scene, 0.01, tick);
  EXPECT_TRUE(tick.grabs[0].place.has_value());
  EXPECT_EQ(tick.grabs[0].leftAtStart, 1);
  const float left = tick.grabs[0].leftAtEnd;
  EXPECT_LT(left, 1);
  const std::vector<GrabsAndAttachments::Slot> then = grabs.state().slots;
  for (int i = 0; i < 30; ++i) grabs.advance(scene, 0.02, tick);
  EXPECT_EQ(tick.grabs[0].leftAtEnd, 0);
  EXPECT_FALSE(tick.grabs[0].place.has_value());
  simulation::HeldNodes held{.nodes = {{.node = 2, .grab = 0}}, .grabs = {{.taken = 1}}};
  grabs.goBack(then, held);
  grabs.advance(scene, 0.03, tick);
  EXPECT_EQ(tick.grabs[0].leftAtStart, left);
}

TEST(GrabsAndAttachments, GrabStartsHoldsAndReleases) {
  using State = simulation::Grab::State;
  const model::Scene scene = sceneWithBall();
  GrabsAndAttachments holds(scene);
  simulation::TickInputs tick;
  const auto grabAt = [](std::uint32_t id, float x) {
    return model::Grab{.id = id, .pose = {Vec3(x, 0, 0), model::Quaternion::Identity()}};
  };
  holds.place(7, std::vector{grabAt(1, 0)}, {});
  holds.place(8, std::vector{grabAt(1, 9)}, {});
  holds.advance(scene, 0.01, tick);
  ASSERT_EQ(tick.grabs.size(), 2u);
  EXPECT_EQ(tick.grabs[0].state, State::takes);
  holds.place(7, std::vector{grabAt(1, 0.1f)}, {});
  holds.advance(scene, 0.02, tick);
  EXPECT_EQ(tick.grabs[0].state, State::holds);
  EXPECT_EQ(tick.grabs[0].start.position.x(), 0);
  EXPECT_EQ(tick.grabs[0].end.position.x(), 0.1f);
  holds.advance(scene, 0.03, tick);  // without a new pose the grab rests
  EXPECT_EQ(tick.grabs[0].start.position.x(), 0.1f);
  holds.advance(scene, 0.04, tick);
  // The index of a released grab is free for one tick before another grab gets it.
  holds.place(7, {}, {});
  holds.place(9, std::vector{grabAt(5, 3)}, {});
  holds.advance(scene, 0.05, tick);
  ASSERT_EQ(tick.grabs.size(), 3u);
  EXPECT_EQ(tick.grabs[0].state, State::free);
  EXPECT_EQ(tick.grabs[2].state, State::takes);
  holds.place(10, std::vector{grabAt(5, 4)}, {});
  holds.advance(scene, 0.06, tick);
  ASSERT_EQ(tick.grabs.size(), 3u);
  EXPECT_EQ(tick.grabs[0].state, State::takes);
  EXPECT_EQ(tick.grabs[0].end.position.x(), 4);
  for (const std::uint64_t participant : {8u, 9u, 10u}) holds.place(participant, {}, {});
  holds.advance(scene, 0.07, tick);
  EXPECT_EQ(tick.grabs.size(), 3u);
  holds.advance(scene, 0.08, tick);
  EXPECT_TRUE(tick.grabs.empty());
}

TEST(GrabsAndAttachments, LimitsGrabsToTheDevicesMaximum) {
  const model::Scene scene = sceneWithBall();
  GrabsAndAttachments holds(scene);
  for (std::uint64_t participant = 1; participant <= simulation::kMaxGrabs + 5; ++participant)
    holds.place(participant, std::vector{model::Grab{.id = 1}}, {});
  simulation::TickInputs tick;
  holds.advance(scene, 0.01, tick);
  EXPECT_EQ(tick.grabs.size(), simulation::kMaxGrabs);
}

TEST(Inbox, KeepsOnlyTheNewestPosesOfAParticipant) {
  Inbox inbox;
  const Clock::time_point arrival = Clock::now();
  inbox.postPoses(1, {.colliders = {handAt(1, 0), handAt(2, 0)}}, arrival);
  inbox.postPoses(2, {.colliders = {handAt(1, 5)}}, arrival);
  inbox.postPoses(1, {.colliders = {handAt(3, 1)}}, arrival + std::chrono::milliseconds(1));
  Inputs inputs;
  inbox.drain(inputs);
  ASSERT_EQ(inputs.poses.size(), 2u);
  EXPECT_EQ(inputs.poses[0].participant, 1u);
  ASSERT_EQ(inputs.poses[0].now.poses.colliders.size(), 1u);
  EXPECT_EQ(inputs.poses[0].now.poses.colliders[0].id, 3u);
  EXPECT_EQ(inputs.poses[0].now.arrival, arrival + std::chrono::milliseconds(1));
  inbox.drain(inputs);
  EXPECT_TRUE(inputs.poses.empty());
}

// No tick drains the inbox of a paused scene, in which participants come and go.
TEST(Inbox, ForgetsTheNewestOfThoseWhoHaveLeft) {
  Inbox inbox;
  inbox.postPoses(2, {.colliders = {handAt(1, 0)}}, Clock::now());
  constexpr std::uint64_t kNewest = Inbox::kMaxPosters + 100;
  for (std::uint64_t participant = 3; participant <= kNewest; ++participant)
    inbox.postPoses(participant, {}, Clock::now());
  inbox.postPoses(1, {}, Clock::now());
  Inputs inputs;
  inbox.drain(inputs);
  ASSERT_EQ(inputs.poses.size(), Inbox::kMaxPosters);
  EXPECT_EQ(inputs.poses.front().participant, 2u);
  EXPECT_EQ(inputs.poses.back().participant, 1u);
  std::uint64_t newest = 0;
  for (const Poses& poses : inputs.poses) newest = std::max(newest, poses.participant);
  EXPECT_LE(newest, Inbox::kMaxPosters + 2);
}

TEST(Inbox, LimitsWaitingChanges) {
  Inbox inbox;
  std::size_t accepted = 0;
  while (inbox.postChange({.change = gravity(-1)})) ++accepted;
  EXPECT_EQ(accepted, Inbox::kMaxChanges);
  Inputs inputs;
  inbox.drain(inputs);
  EXPECT_EQ(inputs.changes.size(), Inbox::kMaxChanges);
  EXPECT_TRUE(inbox.postChange({}));
}

}  // namespace
}  // namespace clothstream::scene
