// SPDX-License-Identifier: MIT
// How participants share the room for colliders.
#include "server/scene/collider_shares.h"

#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/hands.h"
#include "server/scene/budget.h"
#include "tests/model/solids.h"
#include "tests/serving/scene/roster_test.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using model::Vec3;
using ::testing::HasSubstr;
using tests::handAt;

const ClothBounds kCurtain{.low = Vec3(-1, 0, -0.1f), .high = Vec3(1, 2, 0.1f)};

model::ParticipantCollider boxAt(std::uint32_t id, float x, float size = 1) {
  model::ParticipantCollider box = handAt(id, x);
  box.shape = model::Box{Vec3::Constant(size)};
  return box;
}

std::vector<model::ParticipantCollider> boxes(std::uint32_t count, float x) {
  std::vector<model::ParticipantCollider> all;
  for (std::uint32_t id = 1; id <= count; ++id) all.push_back(boxAt(id, x));
  return all;
}

// The capsules of a hand.
std::vector<model::ParticipantCollider> hand() {
  std::vector<model::ParticipantCollider> bones;
  for (std::uint32_t i = 0; i < messages::kHandBones; ++i) {
    bones.push_back(handAt(messages::kFirstBoneId + i, 0.2f, 1));
    bones.back().shape = model::Capsule{.radius = 0.01f, .length = 0.03f};
  }
  return bones;
}

TEST(ColliderShares, CollidersThatCanTouchNothingWeighNextToNothing) {
  EXPECT_EQ(weightOf(boxAt(1, 990), &kCurtain), kFarWeight);
  EXPECT_EQ(weightOf(boxAt(1, 0, 3), &kCurtain), kMostWeight);
  EXPECT_EQ(weightOf(boxAt(1, 990), nullptr), 1) << "nothing is known about the cloth";
  EXPECT_LT(loadOf(boxes(60, 990), &kCurtain).others, 1);
  EXPECT_EQ(loadOf(boxes(60, 990), &kCurtain).hands, 0);
}

TEST(ColliderShares, AHandWeighsLessThanTwoLargeColliders) {
  const ColliderLoad load = loadOf(hand(), &kCurtain);
  EXPECT_EQ(load.others, 0);
  EXPECT_LE(load.hands, 2);
  EXPECT_GT(load.hands, 0.5);
}

TEST(ColliderShares, AParticipantThatNeedsLessLeavesTheRest) {
  const auto share = [](std::vector<double> needs, double room) { return fairShare(needs, room); };
  EXPECT_EQ(share({1, 2, 3}, 6), INFINITY);
  EXPECT_DOUBLE_EQ(share({60, 1, 60}, 11), 5);
  EXPECT_DOUBLE_EQ(share({60, 60}, 0), 0);
  EXPECT_DOUBLE_EQ(share({60}, -1), 0);
  EXPECT_EQ(share({}, 1), INFINITY);
}

TEST(ColliderShares, TrimmingKeepsHands) {
  std::vector<model::ParticipantCollider> colliders = boxes(20, 0);
  const std::vector<model::ParticipantCollider> bones = hand();
  colliders.insert(colliders.end(), bones.begin(), bones.end());
  const ColliderLoad all = loadOf(colliders, &kCurtain);
  EXPECT_FALSE(trim(colliders, all, &kCurtain));
  EXPECT_TRUE(trim(colliders, {.hands = all.hands, .others = all.others / 4}, &kCurtain));
  EXPECT_EQ(colliders.size(), bones.size() + 5);
  EXPECT_TRUE(trim(colliders, {.hands = all.hands, .others = 0}, &kCurtain));
  EXPECT_EQ(colliders.size(), bones.size());
}

// Room for 12 large colliders, next to any number of hands.
class Room : public ColliderBudget {
 public:
  double roomForHands() const override { return 16; }
  double roomForOthers(double) const override { return 12 * kMostWeight; }
  messages::Result<void> chargeJoints() override {
    if (hasRoomForJoints) return {};
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED, "no room for joints", std::nullopt});
  }
  void chargeColliders(const ColliderLoad& load) override { charged = load; }
  bool boundsOfCloth(ClothBounds& bounds) const override {
    bounds = kCurtain;
    return true;
  }
  ColliderLoad charged;
  bool hasRoomForJoints = true;
};

class SharingTest : public ::testing::Test {
 protected:
  // Lets a participant send poses. Returns the error.
  std::string send(Member& member, std::vector<model::ParticipantCollider> colliders) {
    const auto posted = newest.post(*member.mailbox, {}, {.colliders = std::move(colliders)}, {}, now);
    return posted ? std::string() : posted.error().text;
  }
  // Colliders that a participant has after the next tick; those of the tick before if it has none waiting.
  std::size_t acting(std::uint64_t id) {
    Inputs inputs;
    inbox.drain(inputs);
    for (const Poses& poses : inputs.poses) has[poses.participant] = poses.now.poses.colliders.size();
    return has[id];
  }
  // What the server does every second.
  void aSecondLater() {
    roster.expire(now);
    newest.divideRoom(now);
  }
  void join(Member& member) { ASSERT_TRUE(roster.join({}, member.mailbox, ids, 8, now)); }

  Clock::time_point now = Clock::now();
  std::atomic<std::uint64_t> ids{0};
  delivery::Subscribers subscribers;
  Inbox inbox;
  Room room;
  NewestPoses newest{subscribers, inbox, &room};
  Roster roster{subscribers, newest, nullptr};
  std::map<std::uint64_t, std::size_t> has;
};

TEST_F(SharingTest, OneParticipantTakesNothingFromOthers) {
  Member greedy, other;
  join(greedy);
  join(other);
  const std::string error = send(greedy, [] {
    std::vector<model::ParticipantCollider> large;
    for (std::uint32_t id = 1; id <= 60; ++id) large.push_back(boxAt(id, 0, 3));
    return large;
  }());
  EXPECT_THAT(error, HasSubstr("12 of 60 colliders act"));
  EXPECT_EQ(acting(1), 12u);
  EXPECT_EQ(send(other, hand()), "");
  EXPECT_EQ(acting(2), hand().size());
  // The other one comes with colliders, too: each gets half, at the latest a second later.
  std::vector<model::ParticipantCollider> four;
  for (std::uint32_t id = 1; id <= 4; ++id) four.push_back(boxAt(id, 0, 3));
  EXPECT_EQ(send(other, four), "");
  EXPECT_EQ(acting(2), 4u);
  aSecondLater();
  EXPECT_EQ(acting(1), 8u);
  EXPECT_LE(room.charged.others, 12 * kMostWeight + 1e-3);
  // A participant that leaves gives its share back.
  roster.leave(*other.mailbox, LeaveReason::left, now);
  aSecondLater();
  EXPECT_EQ(acting(1), 12u);
}

TEST_F(SharingTest, AReconnectWinsNothing) {
  Member greedy, back, other;
  auto admission = roster.join({}, greedy.mailbox, ids, 8, now);
  ASSERT_TRUE(admission);
  join(other);
  std::vector<model::ParticipantCollider> large;
  for (std::uint32_t id = 1; id <= 60; ++id) large.push_back(boxAt(id, 0, 3));
  send(greedy, large);
  large.resize(10);
  EXPECT_THAT(send(other, large), HasSubstr("6 of 10 colliders act"));
  ReconnectGrace grace;
  roster.disconnect(*greedy.mailbox, grace, now);
  now += grace.poses;
  aSecondLater();
  EXPECT_EQ(acting(2), 10u);
  ASSERT_TRUE(roster.join({.token = admission->token, .attempt = 1}, back.mailbox, ids, 8, now));
  EXPECT_EQ(acting(1), 6u);
  aSecondLater();
  EXPECT_EQ(acting(2), 6u);
}

TEST_F(SharingTest, SaysOnceThatCollidersDoNotAct) {
  Member greedy;
  join(greedy);
  std::vector<model::ParticipantCollider> large;
  for (std::uint32_t id = 1; id <= 13; ++id) large.push_back(boxAt(id, 0, 3));
  EXPECT_NE(send(greedy, large), "");
  EXPECT_EQ(send(greedy, large), "");
  large.pop_back();
  EXPECT_EQ(send(greedy, large), "");
  large.push_back(boxAt(99, 0, 3));
  EXPECT_NE(send(greedy, large), "");
}

TEST_F(SharingTest, HandsActWithoutTheJointsThatHaveNoRoom) {
  Member member;
  join(member);
  Inputs inputs;
  const auto move = [&](std::vector<model::ParticipantCollider> colliders) {
    model::ParticipantPoses poses{.colliders = std::move(colliders)};
    poses.joints = {{.collider = 0, .joints = {model::Pose{}}}};
    v1::ColliderPoses message;
    message.add_joints()->set_collider("avatar");
    const auto posted = newest.post(*member.mailbox, message, std::move(poses), {}, now);
    inbox.drain(inputs);
    return posted ? std::string() : posted.error().text;
  };
  const auto moved = [&] { return inputs.poses.at(0).now.poses; };
  room.hasRoomForJoints = false;
  EXPECT_EQ(move(hand()), "no room for joints");
  EXPECT_EQ(moved().colliders.size(), hand().size());
  EXPECT_TRUE(moved().joints.empty());
  EXPECT_EQ(move(hand()), "") << "said once";
  EXPECT_EQ(moved().colliders.size(), hand().size());
  EXPECT_TRUE(moved().joints.empty());
  room.hasRoomForJoints = true;
  EXPECT_EQ(move(hand()), "");
  EXPECT_EQ(moved().joints.size(), 1u);
  // Both begin at the same time: one error after the other.
  room.hasRoomForJoints = false;
  std::vector<model::ParticipantCollider> large;
  for (std::uint32_t id = 1; id <= 13; ++id) large.push_back(boxAt(id, 0, 3));
  EXPECT_EQ(move(large), "no room for joints");
  EXPECT_THAT(move(large), HasSubstr("12 of 13 colliders act"));
  EXPECT_EQ(move(large), "");
}

// Parameters, other scenes and boxes cannot use up the room for hands.
TEST(ColliderShares, HandsAlwaysHaveRoom) {
  const model::Scene scene = tests::smallScene();
  auto budget = std::make_shared<Budget>(BudgetLimits{.sceneLoad = 0, .load = 0});
  budget->setSpeed({.nodeStepSeconds = 1e-6, .dispatchSeconds = 0, .workgroupFactor = 1});
  Charge charge(budget, scene, true);
  EXPECT_GE(charge.roomForHands(scene), 16);
  EXPECT_EQ(charge.roomForOthers(scene, 0), 0);
  charge.chargeColliders(scene, {.hands = 16, .others = 0});
  EXPECT_EQ(budget->usage().load, 0);
}

TEST(ColliderShares, MovingJointsHasAPrice) {
  model::Scene scene = tests::smallScene();
  model::ClosedMesh mesh = *model::boxMesh(Vec3(0.2f, 1, 0.2f));
  mesh.skin.emplace().joints.push_back({"arm", std::nullopt, {}});
  mesh.skin->vertices.resize(mesh.vertices.size(), {.joints = {}, .weights = {1, 0, 0, 0}});
  scene.colliders[0].shape = std::make_shared<const model::ClosedMesh>(std::move(mesh));
  const auto chargeWith = [&](double most, double& load) {
    const auto budget =
        std::make_shared<Budget>(BudgetLimits{.sceneLoad = most, .load = most, .tickSeconds = 0});
    budget->setSpeed({.nodeStepSeconds = 1e-6, .dispatchSeconds = 0, .workgroupFactor = 1});
    Charge charge(budget, scene, true);
    const double before = charge.work(scene, 1).nodeSteps;
    const messages::Result<void> charged = charge.chargeJoints("colliderPoses.joints", scene);
    load = budget->usage().load;
    EXPECT_EQ(charge.work(scene, 1).nodeSteps > before, charged.has_value());
    EXPECT_EQ(charge.exceedsStart(scene), charged.has_value());
    return charged ? std::string() : charged.error().text;
  };
  double load = 0;
  EXPECT_EQ(chargeWith(1e9, load), "");
  EXPECT_GT(load, 0);
  EXPECT_THAT(chargeWith(load / 2, load), HasSubstr("colliderPoses.joints: would take"));
  EXPECT_EQ(load, 0);
}

TEST(ColliderShares, HeldWindsHaveAPrice) {
  const model::Scene scene = tests::smallScene();
  const auto budget = std::make_shared<Budget>(BudgetLimits{.sceneLoad = 1, .load = 1, .tickSeconds = 0});
  budget->setSpeed({.nodeStepSeconds = 1e-6, .dispatchSeconds = 0, .workgroupFactor = 1});
  Charge charge(budget, scene, true);
  ASSERT_TRUE(charge.chargeWinds("colliderPoses.winds", scene, 1));
  const double one = budget->usage().load;
  EXPECT_GT(one, 0);
  ASSERT_TRUE(charge.chargeWinds("colliderPoses.winds", scene, 2));
  EXPECT_NEAR(budget->usage().load, 2 * one, 1e-9);
  const auto refused = charge.chargeWinds("colliderPoses.winds", scene, 1'000'000);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("colliderPoses.winds: would take"));
  EXPECT_NEAR(budget->usage().load, 2 * one, 1e-9);
  EXPECT_TRUE(charge.chargeWinds("colliderPoses.winds", scene, 0));
  EXPECT_EQ(budget->usage().load, 0);
}

TEST(ColliderShares, AScenesCollidersLeaveHalfOfTheFreeLoadToTheNext) {
  const model::Scene scene = tests::smallScene();
  const auto budget = std::make_shared<Budget>(BudgetLimits{.sceneLoad = 1e9, .load = 1, .tickSeconds = 0});
  budget->setSpeed({.nodeStepSeconds = 1e-6, .dispatchSeconds = 0, .workgroupFactor = 1});
  Charge first(budget, scene, true), second(budget, scene, true);
  const double room = first.roomForOthers(scene, 0);
  first.chargeColliders(scene, {.hands = 0, .others = room});
  EXPECT_NEAR(budget->usage().load, 0.5, 1e-6);
  EXPECT_NEAR(second.roomForOthers(scene, 0), room / 2, 1e-6 * room);
  EXPECT_NEAR(first.roomForOthers(scene, 0), room, 1e-6 * room) << "its own colliders count once";
}

TEST(ColliderShares, CollidersDoNotMakeASceneLate) {
  const model::Scene scene = tests::smallScene();
  const auto budget = std::make_shared<Budget>(BudgetLimits{.sceneLoad = 1e9, .load = 1e9, .tickSeconds = 0});
  const auto chargeAt = [&](double nodeStepSeconds, const ColliderLoad& colliders) {
    budget->setSpeed({.nodeStepSeconds = nodeStepSeconds, .dispatchSeconds = 0, .workgroupFactor = 1});
    Charge charge(budget, scene, true);
    charge.chargeColliders(
        scene, {.hands = colliders.hands, .others = charge.roomForOthers(scene, colliders.hands)});
    return charge.load(scene);
  };
  EXPECT_NEAR(chargeAt(1e-6, {}), 0.7, 1e-6);
  EXPECT_NEAR(chargeAt(1e-6, {.hands = 2, .others = 0}), 0.7, 1e-6) << "hands first";
  // A scene that is late already has some room.
  Charge slow(budget, scene, true);
  budget->setSpeed({.nodeStepSeconds = 1e-3, .dispatchSeconds = 0, .workgroupFactor = 1});
  EXPECT_DOUBLE_EQ(slow.roomForOthers(scene, 0), 4);
}

}  // namespace
}  // namespace clothstream::scene
