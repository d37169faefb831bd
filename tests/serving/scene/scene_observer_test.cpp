// SPDX-License-Identifier: MIT
// What an observer learns about participants.
#include "server/scene/scene_observer.h"

#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/roster.h"
#include "tests/serving/scene/roster_test.h"

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;

class Visits final : public SceneObserver {
 public:
  void joined(const Participant& participant, const Subject& subject) override {
    lines.push_back(fmt::format("{} joined {} {}", participant.id, nameOf(participant.role), subject.name));
  }
  void left(const Participant& participant, const Subject& subject, Clock::duration connected) override {
    lines.push_back(fmt::format("{} left {} {} {}", participant.id, nameOf(participant.role), subject.name,
                                schedule::seconds(connected)));
  }

  std::vector<std::string> lines;
};

class SceneObserverTest : public RosterTest {
 protected:
  void SetUp() override { roster.observe(visits); }

  std::vector<std::string> heard() { return std::exchange(visits.lines, {}); }

  Visits visits;
  const Person ada = tokenOf("ada", Ownership::ifNone), bob = tokenOf("bob", Ownership::ifNone);
};

TEST_F(SceneObserverTest, LearnsWhoJoinsAndLeaves) {
  const Member first = join(ada);
  pass(3s);
  const Member second = join(bob, Role::viewer);
  pass(2s);
  leave(first);
  leave(first);
  leave(second);
  EXPECT_THAT(heard(), ElementsAre("1 joined owner ada", "2 joined viewer bob", "1 left owner ada 5",
                                   "2 left viewer bob 2"));
}

TEST_F(SceneObserverTest, AVisitContinuesAfterAReturn) {
  const Member first = join(ada);
  pass(10s);
  lose(first);
  pass(1s);
  const Member again = comeBack(first, ada);
  pass(5s);
  const Member taken = comeBack(again, ada);  // another connection takes over
  pass(5s);
  EXPECT_THAT(heard(), ElementsAre("1 joined owner ada"));
  lose(taken);
  pass(1s);
  EXPECT_THAT(heard(), ElementsAre());
  pass(60s);
  EXPECT_THAT(heard(), ElementsAre("1 left owner ada 20")) << "without the time while it was away";
}

TEST_F(SceneObserverTest, LearnsOfRemovedAndEvictedParticipants) {
  limit = 2;
  const Member owner = join(ada);
  const Member other = join(bob);
  ASSERT_TRUE(remove(owner, 2));
  EXPECT_THAT(heard(),
              ElementsAre("1 joined owner ada", "2 joined participant bob", "2 left participant bob 0"));
  const Member third = join(bob);
  lose(third);
  const Member fourth = join(ada);
  EXPECT_THAT(heard(), ElementsAre("3 joined participant bob", "3 left participant bob 0",
                                   "4 joined participant ada"));
}

TEST_F(SceneObserverTest, ClosingLetsEveryoneLeave) {
  join(ada);
  join(bob);
  heard();
  roster.close(nullptr);
  EXPECT_EQ(heard().size(), 2u);
  roster.endObservation(true);
  EXPECT_THAT(heard(), ElementsAre());
}

TEST_F(SceneObserverTest, ParticipantsOfAKeptSceneDoNotLeave) {
  const Member first = join(ada);
  heard();
  roster.endObservation(false);
  leave(first);
  EXPECT_THAT(heard(), ElementsAre());
}

TEST_F(SceneObserverTest, RestoredParticipantsAreNotNew) {
  const Member first = join(ada);
  lose(first);
  const SavedRoster saved = roster.saved();
  Roster next(subscribers, later, nullptr);
  next.observe(visits);
  heard();
  next.restore(saved, {60s, 20s, 2s}, now);
  EXPECT_THAT(heard(), ElementsAre());
  next.expire(now + 61s);
  EXPECT_THAT(heard(), ElementsAre("1 left owner ada 0")) << "it was not connected in this run";
}

}  // namespace
}  // namespace clothstream::scene
