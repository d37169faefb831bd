// SPDX-License-Identifier: MIT
// Definition of a scene after its simulation was reset or reverted.
#include "server/scene/live_scene.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using tests::smallScene;

TEST(LiveScene, RestartRestoresTheStart) {
  model::Scene scene = smallScene();
  scene.colliders[0].motion.keys.clear();
  LiveScene live(std::move(scene));
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  v1::ColliderChange& ball = *change.add_colliders();
  ball.set_name("ball");
  ball.mutable_position()->set_y(7);
  ASSERT_TRUE(live.change(1, change, Role::owner));
  live.tick = 50;
  live.resetRequested = true;
  EXPECT_EQ(live.restart().wind().value().x(), 0);
  EXPECT_EQ(live.definition().environment.wind, live.start().environment.wind);
  EXPECT_EQ(live.definition().colliders[0].pose.position, live.start().colliders[0].pose.position);
  Inputs waiting;
  live.inbox.drain(waiting);
  EXPECT_TRUE(waiting.changes.empty());
  EXPECT_EQ(live.tick, 0u);
  EXPECT_FALSE(live.resetRequested);
}

TEST(LiveScene, RestartForgetsTheRestoredState) {
  LiveScene live(smallScene());
  SavedScene saved{.start = smallScene(), .accepted = smallScene()};
  saved.accepted->environment.gravity.y() = -3;
  live.restore(std::move(saved), {}, Clock::now());
  ASSERT_NE(live.restored(), nullptr);
  live.restart();
  EXPECT_EQ(live.restored(), nullptr);
}

// The grace of an earlier run's participants does not pass while the server starts.
TEST(LiveScene, GraceOfRestoredParticipantsCanBeginLater) {
  LiveScene live(smallScene());
  SavedScene saved{.start = smallScene()};
  saved.roster.participants.emplace_back().participant.id = 3;
  const ReconnectGrace grace{.place = std::chrono::seconds(5)};
  const Clock::time_point restored = Clock::now(), opened = restored + std::chrono::seconds(60);
  live.restore(std::move(saved), grace, restored);
  live.roster.restartGrace(grace, opened);
  live.roster.expire(opened + std::chrono::seconds(4));
  EXPECT_EQ(live.roster.away(), 1u);
  live.roster.expire(opened + std::chrono::seconds(5));
  EXPECT_EQ(live.roster.away(), 0u);
}

// Changes of one participant until one is refused.
struct Changes {
  int accepted = 0;
  std::string refused;
};
Changes changeUntilRefused(LiveScene& live, std::uint64_t participant) {
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  Changes changes;
  messages::Result<void> result;
  Inputs applied;
  while (changes.accepted < 10'000 && (result = live.change(participant, change, Role::owner))) {
    ++changes.accepted;
    live.inbox.drain(applied);
  }
  if (!result) changes.refused = result.error().text;
  return changes;
}

TEST(LiveScene, LimitsChangesOfOneParticipantSoThatOthersHaveTheirs) {
  LiveScene live(smallScene());
  const Changes first = changeUntilRefused(live, 1);
  EXPECT_GE(first.accepted, static_cast<int>(ChangeLimits::kOfParticipantPerSecond));
  EXPECT_EQ(
      first.refused,
      "parameterChange: too many changes of 'small' by one participant in one second; send it again later");
  EXPECT_GE(changeUntilRefused(live, 2).accepted, static_cast<int>(ChangeLimits::kOfParticipantPerSecond));
}

TEST(LiveScene, LimitsChangesPerSecondOfAllParticipants) {
  LiveScene live(smallScene());
  int accepted = 0;
  std::string refused;
  for (std::uint64_t participant = 1; participant < 1000; ++participant) {
    const Changes changes = changeUntilRefused(live, participant);
    accepted += changes.accepted;
    refused = changes.refused;
    if (refused.find("by one participant") == std::string::npos) break;
  }
  EXPECT_GE(accepted, static_cast<int>(ChangeLimits::kPerSecond));
  EXPECT_EQ(refused, "parameterChange: too many changes of 'small' in one second; send it again later");
}

// Everyone in the scene gets the announcement of a change.
TEST(LiveScene, LimitsTheBytesOfChangesPerSecond) {
  LiveScene live(smallScene());
  v1::ParameterChange change;
  for (int i = 0; i < 256; ++i) {
    v1::ClothChange& cloth = *change.add_cloths();
    cloth.set_name(live.start().cloths[0].name);
    cloth.set_drag(1);
    cloth.mutable_structural()->set_stiffness(1);
  }
  const auto most =
      static_cast<int>(ChangeLimits::kOfParticipantBurstBytes / static_cast<double>(change.ByteSizeLong()));
  ASSERT_LT(most, static_cast<int>(ChangeLimits::kOfParticipantPerSecond));
  int accepted = 0;
  messages::Result<void> result;
  Inputs applied;
  while (accepted < 1000 && (result = live.change(1, change, Role::owner))) {
    ++accepted;
    live.inbox.drain(applied);
  }
  EXPECT_GE(accepted, most);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(result.error().text, testing::HasSubstr("too many bytes of changes of 'small' by one"));
  EXPECT_TRUE(live.change(2, change, Role::owner)) << "others have their share";
}

// Fields that this release does not know are announced, too.
TEST(LiveScene, RefusesAChangeWhoseAnnouncementIsTooLarge) {
  LiveScene live(smallScene());
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  const auto most = static_cast<std::size_t>(ChangeLimits::kOfParticipantBurstBytes);
  change.GetReflection()->MutableUnknownFields(&change)->AddLengthDelimited(1000, std::string(most, 'x'));
  const messages::Result<void> refused = live.change(1, change, Role::owner);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(refused.error().text, testing::HasSubstr("change fewer cloths at once"));
  EXPECT_EQ(live.definition().environment.wind.x(), 0);
  change.GetReflection()->MutableUnknownFields(&change)->Clear();
  EXPECT_TRUE(live.change(1, change, Role::owner)) << "nothing was charged";
}

TEST(ChangeLimits, CountsNumberAndBytesOfEachParticipantAndOfAll) {
  using Exceeded = ChangeLimits::Exceeded;
  ChangeLimits limits;
  Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  const auto bytes = static_cast<std::size_t>(ChangeLimits::kOfParticipantBurstBytes);
  EXPECT_EQ(limits.countBytes(1, bytes, now), Exceeded::nothing);
  EXPECT_EQ(limits.countBytes(1, 1, now), Exceeded::byParticipant);
  EXPECT_EQ(limits.countBytes(2, bytes, now), Exceeded::nothing);
  EXPECT_EQ(limits.countBytes(3, 1, now), Exceeded::byAll);
  for (int i = 0; i < static_cast<int>(ChangeLimits::kOfParticipantPerSecond); ++i)
    EXPECT_EQ(limits.count(1, now), Exceeded::nothing);
  EXPECT_EQ(limits.count(1, now), Exceeded::byParticipant);
  now += std::chrono::seconds(1);
  EXPECT_EQ(limits.count(1, now), Exceeded::nothing);
  const auto perSecond = static_cast<std::size_t>(ChangeLimits::kOfParticipantBytesPerSecond);
  EXPECT_EQ(limits.countBytes(1, perSecond, now), Exceeded::nothing);
  EXPECT_EQ(limits.countBytes(1, 100, now), Exceeded::byParticipant);
  now += std::chrono::hours(1);
  EXPECT_EQ(limits.countBytes(1, bytes, now), Exceeded::nothing);
}

TEST(LiveScene, BecomesAGuestWhileItCostsMoreThanAtItsStart) {
  const auto budget = std::make_shared<Budget>(
      BudgetLimits{.sceneLoad = 1e9, .load = 1e9, .sceneMegabytes = 1e9, .megabytes = 1e9});
  budget->setSpeed({.nodeStepSeconds = 1e-9, .dispatchSeconds = 1e-6, .workgroupFactor = 1});
  model::Scene scene = smallScene();
  scene.cloths[0].solver.kind = model::SolverKind::constraint;
  scene.cloths[0].solver.iterations = 10;
  LiveScene live(std::move(scene), {}, nullptr, budget);
  EXPECT_FALSE(live.isGuest());
  v1::ParameterChange change;
  v1::ClothChange& cloth = *change.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_solver()->mutable_constraint()->set_iterations(100);
  ASSERT_TRUE(live.change(1, change, Role::owner));
  EXPECT_TRUE(live.isGuest());
  Inputs applied;
  live.inbox.drain(applied);  // revertTo() keeps waiting changes
  live.revertTo(live.start());
  EXPECT_FALSE(live.isGuest());
}

TEST(LiveScene, RevertKeepsAppliedAndWaitingChanges) {
  LiveScene live(smallScene());
  v1::ParameterChange waiting;
  waiting.mutable_wind()->mutable_value()->set_x(3);
  ASSERT_TRUE(live.change(1, waiting, Role::owner));
  model::Scene now = smallScene();
  now.cloths[0].thickness = 0.02f;
  const v1::ParameterChange said = live.revertTo(now);
  EXPECT_EQ(said.cloths(0).thickness(), 0.02f);
  EXPECT_TRUE(said.cloths(0).solver().has_mass_spring());
  EXPECT_EQ(said.wind().value().x(), 0);
  EXPECT_EQ(live.definition().cloths[0].thickness, 0.02f);
  EXPECT_EQ(live.definition().environment.wind.x(), 3);
}

}  // namespace
}  // namespace clothstream::scene
