// SPDX-License-Identifier: MIT
// Newest poses of participants on their way to the inbox.
#include "server/scene/newest_poses.h"

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/mailbox.h"
#include "server/delivery/subscribers.h"
#include "server/scene/inbox.h"
#include "server/schedule/clock.h"
#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class NewestPosesTest : public ::testing::Test {
 protected:
  std::shared_ptr<delivery::Mailbox> add(std::uint64_t id, Role role) {
    auto mailbox = std::make_shared<delivery::Mailbox>(nullptr);
    subscribers.add(mailbox, id);
    newest.add(id, role);
    return mailbox;
  }
  messages::Result<void> post(const delivery::Mailbox& mailbox) {
    v1::ColliderPoses message;
    message.add_colliders();
    return newest.post(mailbox, message, {.colliders = {tests::handAt(1, 0)}}, {}, now);
  }
  // Inputs of the next tick as text: participant and number of colliders.
  std::vector<std::string> inputs() {
    Inputs drained;
    inbox.drain(drained);
    std::vector<std::string> lines;
    for (const Poses& poses : drained.poses)
      lines.push_back(fmt::format("{}: {}", poses.participant, poses.now.poses.colliders.size()));
    return lines;
  }

  Clock::time_point now = Clock::time_point{} + 1000s;
  delivery::Subscribers subscribers;
  Inbox inbox;
  NewestPoses newest{subscribers, inbox};
};

TEST_F(NewestPosesTest, PoseTimesAreLimitedToAPlausibleRange) {
  const std::shared_ptr<delivery::Mailbox> mailbox = add(1, Role::participant);
  const auto trueAt = [&](std::int64_t laterUs) {
    v1::ColliderPoses message;
    message.set_client_time_us(77);
    message.set_server_time_us(schedule::microseconds(now) + static_cast<std::uint64_t>(laterUs));
    EXPECT_TRUE(newest.post(*mailbox, message, {}, {}, now));
    Inputs drained;
    inbox.drain(drained);
    EXPECT_EQ(drained.poses.at(0).now.time.clientTimeUs, 77u);
    return drained.poses.at(0).now.time.trueAt;
  };
  EXPECT_EQ(trueAt(-30'000), now - 30ms);
  EXPECT_EQ(trueAt(100'000), now + 100ms);
  EXPECT_EQ(trueAt(100'001), std::nullopt);
  EXPECT_EQ(trueAt(std::numeric_limits<std::int64_t>::max()), std::nullopt);
  EXPECT_EQ(trueAt(-3'600'000'000), now - 10s);
  EXPECT_EQ(trueAt(std::numeric_limits<std::int64_t>::min()), now - 10s);
  EXPECT_EQ(trueAt(-static_cast<std::int64_t>(schedule::microseconds(now))), std::nullopt) << "0: not known";
}

TEST_F(NewestPosesTest, DropsPosesOfThoseWhoLeft) {
  const auto removed = add(1, Role::participant), disconnected = add(2, Role::participant);
  newest.remove(1, now);
  subscribers.remove(*disconnected);
  EXPECT_TRUE(post(*removed));
  EXPECT_TRUE(post(*disconnected));
  EXPECT_THAT(inputs(), IsEmpty());
}

TEST_F(NewestPosesTest, WithdrawnPosesComeBackOnce) {
  const auto mailbox = add(1, Role::participant);
  ASSERT_TRUE(post(*mailbox));
  inputs();
  newest.withdraw(1, now);
  EXPECT_THAT(inputs(), ElementsAre("1: 0"));
  newest.withdraw(1, now);
  EXPECT_THAT(inputs(), IsEmpty());
  newest.resume(1, now);
  EXPECT_THAT(inputs(), ElementsAre("1: 1"));
  newest.resume(1, now);
  EXPECT_THAT(inputs(), IsEmpty());
}

TEST_F(NewestPosesTest, ForgetsThePosesOfAViewer) {
  const auto mailbox = add(1, Role::owner);
  ASSERT_TRUE(post(*mailbox));
  newest.setRole(1, Role::viewer, now);
  EXPECT_THAT(inputs(), ElementsAre("1: 0"));
  EXPECT_EQ(post(*mailbox).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  newest.setRole(1, Role::participant, now);
  newest.resume(1, now);
  EXPECT_THAT(inputs(), IsEmpty());
  EXPECT_TRUE(post(*mailbox));
  EXPECT_THAT(inputs(), ElementsAre("1: 1"));
}

// Room for winds, and a price that grows with them.
class WindBudget : public ColliderBudget {
 public:
  double roomForHands() const override { return 100; }
  double roomForOthers(double) const override { return 100; }
  messages::Result<void> chargeWinds(std::size_t count) override {
    if (count > charged && count > most)
      return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED, "too dear"});
    charged = count;
    return {};
  }
  void chargeColliders(const ColliderLoad&) override {}
  bool boundsOfCloth(ClothBounds&) const override { return false; }
  std::size_t most = 8, charged = 0;
};

model::ParticipantPoses winds(std::size_t count) {
  model::ParticipantPoses poses;
  for (std::uint32_t id = 0; id < count; ++id) poses.winds.push_back({{.speed = 1}, id});
  return poses;
}

TEST_F(NewestPosesTest, WindsEndWithTheRightToThem) {
  const auto mailbox = add(1, Role::owner);
  v1::ColliderPoses message;
  message.add_winds();
  const Permissions none{.environment = false};
  model::ParticipantPoses poses = winds(1);
  poses.grabs.emplace_back();
  ASSERT_TRUE(newest.post(*mailbox, message, poses, none, now));
  const auto taken = [&] {
    Inputs drained;
    inbox.drain(drained);
    return drained.poses.empty() ? model::ParticipantPoses() : drained.poses.back().now.poses;
  };
  EXPECT_EQ(taken().winds.size(), 1u);
  newest.setRole(1, Role::participant, now);
  const model::ParticipantPoses left = taken();
  EXPECT_TRUE(left.winds.empty());
  EXPECT_EQ(left.grabs.size(), 1u) << "the other poses stay";
  EXPECT_EQ(newest.post(*mailbox, message, winds(1), none, now).error().code,
            v1::ERROR_CODE_PERMISSION_DENIED);
  newest.withdraw(1, now);
  taken();
  newest.resume(1, now);
  EXPECT_TRUE(taken().winds.empty());
}

TEST_F(NewestPosesTest, WindsWithoutRoomAfterAReturnAreTold) {
  NewestPoses room(subscribers, inbox, nullptr, 1);
  const auto ada = add(1, Role::participant), bob = add(2, Role::participant);
  room.add(1, Role::participant);
  room.add(2, Role::participant);
  ASSERT_TRUE(room.post(*ada, {}, winds(1), {}, now));
  room.withdraw(1, now);
  ASSERT_TRUE(room.post(*bob, {}, winds(1), {}, now));
  room.resume(1, now);
  EXPECT_EQ(room.post(*ada, {}, winds(1), {}, now).error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
}

TEST_F(NewestPosesTest, WindsActAsFarAsThereIsRoom) {
  WindBudget budget;
  NewestPoses room(subscribers, inbox, &budget, 3);
  const auto ada = add(1, Role::participant), bob = add(2, Role::participant);
  room.add(1, Role::participant);
  room.add(2, Role::participant);
  const auto hold = [&](const delivery::Mailbox& mailbox, std::size_t count) {
    const auto held = room.post(mailbox, {}, winds(count), {}, now);
    return held ? std::string() : held.error().text;
  };
  const auto acting = [&] {
    Inputs drained;
    inbox.drain(drained);
    return drained.poses.empty() ? 0u : drained.poses.back().now.poses.winds.size();
  };
  EXPECT_EQ(hold(*ada, 2), "");
  EXPECT_EQ(acting(), 2u);
  EXPECT_THAT(hold(*bob, 2), ::testing::HasSubstr("1 of 2 winds act"));
  EXPECT_EQ(acting(), 1u);
  EXPECT_EQ(hold(*bob, 2), "") << "said once";
  EXPECT_EQ(acting(), 1u);
  EXPECT_EQ(budget.charged, 3u);
  room.remove(1, now);
  EXPECT_EQ(acting(), 0u);
  EXPECT_EQ(budget.charged, 1u);
  EXPECT_EQ(hold(*bob, 2), "");
  EXPECT_EQ(acting(), 2u);
  EXPECT_EQ(hold(*bob, 0), "");
  budget.most = 1;
  acting();
  EXPECT_EQ(hold(*bob, 2), "too dear");
  EXPECT_EQ(acting(), 0u);
  EXPECT_EQ(budget.charged, 0u);
}

TEST_F(NewestPosesTest, RemovesWhatACheckpointHas) {
  newest.add(1, Role::participant, true);
  newest.add(2, Role::participant);
  newest.withdraw(1, now);
  newest.withdraw(2, now);
  EXPECT_THAT(inputs(), ElementsAre("1: 0"));
}

}  // namespace
}  // namespace clothstream::scene
