// SPDX-License-Identifier: MIT
// Bodies of a scene that participants take and give back.
#include <chrono>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "tests/serving/scene/roster_test.h"

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class WornBodiesTest : public RosterTest {
 protected:
  messages::Result<void> wear(const Member& by, const std::string& body) {
    return roster.wear(*by.mailbox, body);
  }
  // Sends joints of the bodies "avatar" and "giant", and returns the indices of those that act.
  std::vector<std::size_t> moved(const Member& member, messages::Result<void>* answer = nullptr) {
    v1::ColliderPoses message;
    message.add_joints()->set_collider("avatar");
    message.add_joints()->set_collider("giant");
    model::ParticipantPoses poses;
    poses.joints.push_back({.collider = 0, .joints = {}, .jumps = false});
    poses.joints.push_back({.collider = 1, .joints = {}, .jumps = false});
    messages::Result<void> posted = newest.post(*member.mailbox, message, poses, {}, now);
    if (answer) *answer = posted;
    Inputs drained;
    inbox.drain(drained);
    std::vector<std::size_t> acting;
    for (const Poses& one : drained.poses)
      for (const model::ColliderJoints& joints : one.now.poses.joints) acting.push_back(joints.collider);
    return acting;
  }
  std::string bodyOf(std::uint64_t id) {
    for (const SavedParticipant& saved : roster.saved().participants)
      if (saved.participant.id == id) return saved.participant.body;
    return "?";
  }
};

TEST_F(WornBodiesTest, AreTakenByOneParticipantAndAnnouncedToEveryone) {
  Member ada = join(), ben = join();
  ada.read();
  ben.read();
  ASSERT_TRUE(wear(ada, "avatar"));
  EXPECT_THAT(ada.heard(), ElementsAre("body 1 'avatar'"));
  EXPECT_THAT(ben.heard(), ElementsAre("body 1 'avatar'"));
  ASSERT_TRUE(wear(ada, "avatar"));
  EXPECT_THAT(ben.heard(), IsEmpty()) << "nothing has changed";
  const messages::Result<void> refused = wear(ben, "avatar");
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_EQ(refused.error().text,
            "wearBody.collider = \"avatar\": participant 1 wears it; take another body, or wait until it is "
            "given back");
  ASSERT_TRUE(wear(ben, "giant"));
  EXPECT_THAT(ada.heard(), ElementsAre("body 2 'giant'"));
  const Member cy = join();
  EXPECT_EQ(cy.admission.participants[0].body, "avatar");
  EXPECT_EQ(cy.admission.participants[1].body, "giant");
}

TEST_F(WornBodiesTest, AreFreeWhenTheirParticipantTakesAnotherOrGivesThemBack) {
  const Member ada = join(), ben = join();
  ASSERT_TRUE(wear(ada, "avatar"));
  ASSERT_TRUE(wear(ada, "giant"));
  ASSERT_TRUE(wear(ben, "avatar"));
  ASSERT_TRUE(wear(ben, ""));
  EXPECT_EQ(bodyOf(2), "");
  EXPECT_TRUE(wear(ada, "avatar"));
}

TEST_F(WornBodiesTest, AreKeptForTheReconnectGraceAndFreeAfterwards) {
  const Member ada = join(), ben = join();
  ASSERT_TRUE(wear(ada, "avatar"));
  lose(ada);
  pass(50s);
  EXPECT_FALSE(wear(ben, "avatar"));
  const Member back = comeBack(ada);
  EXPECT_EQ(back.admission.participants[0].body, "avatar");
  EXPECT_THAT(moved(ben), ElementsAre(1u));
  lose(back);
  pass(61s);
  EXPECT_TRUE(wear(ben, "avatar"));
  leave(ben);
  const Member cy = join();
  EXPECT_TRUE(wear(cy, "avatar"));
}

TEST_F(WornBodiesTest, AreNotForViewers) {
  const Member ada = join();
  Member ben = join(), cy = join(Role::viewer);
  const messages::Result<void> refused = wear(cy, "avatar");
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_THAT(refused.error().text, StartsWith("wearBody: requires the role participant; yours is viewer"));
  ASSERT_TRUE(wear(ben, "avatar"));
  ASSERT_TRUE(setRole(ada, 2, Role::viewer));
  EXPECT_EQ(bodyOf(2), "");
  EXPECT_TRUE(wear(ada, "avatar"));
}

TEST_F(WornBodiesTest, AreMovedByTheirParticipantOnly) {
  const Member ada = join(), ben = join();
  EXPECT_THAT(moved(ben), ElementsAre(0u, 1u)) << "every participant moves bodies that are free";
  ASSERT_TRUE(wear(ada, "avatar"));
  messages::Result<void> answer;
  EXPECT_THAT(moved(ben, &answer), ElementsAre(1u));
  EXPECT_EQ(answer.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_EQ(answer.error().text,
            "colliderPoses.joints[0].collider = \"avatar\": participant 1 wears it, so only that participant "
            "moves it; "
            "move another one, or wait until it is given back");
  EXPECT_THAT(moved(ben, &answer), ElementsAre(1u));
  EXPECT_TRUE(answer.has_value()) << "the error comes once";
  EXPECT_THAT(moved(ada, &answer), ElementsAre(0u, 1u));
  EXPECT_TRUE(answer.has_value());
  ASSERT_TRUE(wear(ada, ""));
  EXPECT_THAT(moved(ben, &answer), ElementsAre(0u, 1u));
  ASSERT_TRUE(wear(ada, "giant"));
  EXPECT_THAT(moved(ben, &answer), ElementsAre(0u));
  EXPECT_FALSE(answer.has_value()) << "a body that is taken again is refused with an error again";
}

TEST_F(WornBodiesTest, AreKeptInTheNextRunOfTheServer) {
  ASSERT_TRUE(wear(join(), "avatar"));
  const SavedRoster saved = roster.saved();
  Roster next{subscribers, later, nullptr};
  next.restore(saved, {}, now);
  EXPECT_EQ(next.saved().participants.at(0).participant.body, "avatar");
  const Member other;
  subscribers.add(other.mailbox, 99);
  later.add(99, Role::participant);
  v1::ColliderPoses message;
  message.add_joints()->set_collider("avatar");
  model::ParticipantPoses poses;
  poses.joints.push_back({.collider = 0, .joints = {}, .jumps = false});
  EXPECT_FALSE(later.post(*other.mailbox, message, poses, {}, now));
}

}  // namespace
}  // namespace clothstream::scene
