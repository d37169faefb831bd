// SPDX-License-Identifier: MIT
// Definition of a scene after its simulation was reset or reverted.
#include "server/scene/live_scene.h"

#include <utility>

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
  ASSERT_TRUE(live.change(1, change));
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

TEST(LiveScene, LimitsChangesPerSecond) {
  LiveScene live(smallScene());
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  int accepted = 0;
  messages::Result<void> result;
  Inputs applied;
  while (accepted < 10'000 && (result = live.change(1, change))) {
    ++accepted;
    live.inbox.drain(applied);
  }
  EXPECT_GE(accepted, static_cast<int>(LiveScene::kChangesPerSecond));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().text,
            "parameterChange: too many changes of 'small' in one second; send it again later");
}

TEST(LiveScene, RevertKeepsAppliedAndWaitingChanges) {
  LiveScene live(smallScene());
  v1::ParameterChange waiting;
  waiting.mutable_wind()->mutable_value()->set_x(3);
  ASSERT_TRUE(live.change(1, waiting));
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
