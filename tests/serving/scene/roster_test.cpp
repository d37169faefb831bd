// SPDX-License-Identifier: MIT
// Participants of a scene: joining, presence and reconnection.
#include "server/scene/roster.h"

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/delivery/envelope.h"
#include "server/scene/resume_token.h"
#include "tests/serving/scene/roster_test.h"

namespace clothstream::scene {
namespace {

using namespace schedule;

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::vector<std::uint64_t> idsOf(const Roster::Admission& admission) {
  std::vector<std::uint64_t> all;
  for (const Participant& participant : admission.participants) all.push_back(participant.id);
  return all;
}

TEST_F(RosterTest, DismissDropsWaitingPoses) {
  const Member member = join();
  model::ParticipantPoses poses;
  poses.attachments.push_back({});
  EXPECT_TRUE(newest.post(*member.mailbox, {}, poses, {}, now));
  roster.dismiss(nullptr);
  EXPECT_TRUE(newest.post(*member.mailbox, {}, poses, {}, now));  // sent before the dismissal
  Inputs drained;
  inbox.drain(drained);
  EXPECT_TRUE(drained.poses.empty());
}

TEST_F(RosterTest, JoinListsParticipantsAndIsAnnounced) {
  Member first = join(), second = join(), third = join(Role::viewer);
  EXPECT_THAT(idsOf(first.admission), ElementsAre(1));
  EXPECT_THAT(idsOf(third.admission), ElementsAre(1, 2, 3));
  EXPECT_EQ(third.admission.participants[0].displayName, "Ada");
  EXPECT_EQ(third.admission.participants[2].role, Role::viewer);
  leave(second);
  EXPECT_THAT(first.heard(), ElementsAre("joined 2", "joined 3", "left 2"));
  EXPECT_THAT(third.heard(), ElementsAre("left 2"));
  EXPECT_THAT(second.heard(), ElementsAre("joined 3"));
  EXPECT_EQ(subscribers.size(), 2u);
}

TEST_F(RosterTest, FirstParticipantThatIsNotAViewerBecomesOwner) {
  EXPECT_EQ(join(Role::viewer).admission.role, Role::viewer);
  EXPECT_FALSE(roster.owned());
  EXPECT_EQ(join(Role::participant).admission.role, Role::owner);
  EXPECT_EQ(join().admission.role, Role::participant);
  EXPECT_EQ(join(Role::owner).admission.role, Role::participant);
  EXPECT_EQ(join(Role::viewer).admission.role, Role::viewer);
}

TEST_F(RosterTest, LongestPresentParticipantSucceedsTheLastOwner) {
  Member owner = join(), viewer = join(Role::viewer), away = join(), present = join();
  lose(away);
  viewer.heard();
  leave(owner);
  EXPECT_THAT(viewer.heard(), ElementsAre("left 1", "role 4 owner"));
  leave(present);  // the only candidate is away
  EXPECT_THAT(viewer.heard(), ElementsAre("left 4", "role 3 owner"));
  pass(60s);
  EXPECT_THAT(viewer.heard(), ElementsAre("left 3 timed out"));
  EXPECT_FALSE(roster.owned());
}

TEST_F(RosterTest, DisconnectedParticipantLosesPosesThenPlace) {
  Member watcher = join(), lost = join();
  ASSERT_TRUE(pose(lost, 1).has_value());
  EXPECT_THAT(inputs(), ElementsAre("2: 1 colliders, 1 grabs"));
  lose(lost);
  EXPECT_EQ(roster.away(), 1u);
  EXPECT_EQ(subscribers.size(), 1u);
  pass(1999ms);
  EXPECT_THAT(inputs(), IsEmpty());
  pass(1ms);
  EXPECT_THAT(inputs(), ElementsAre("2: 0 colliders, 0 grabs"));
  pass(57999ms);
  EXPECT_THAT(watcher.heard(), ElementsAre("joined 2", "away 2"));
  pass(1ms);
  EXPECT_THAT(watcher.heard(), ElementsAre("left 2 timed out"));
  EXPECT_THAT(inputs(), IsEmpty());
  EXPECT_EQ(roster.size(), 1u);
}

TEST_F(RosterTest, QuickReconnectKeepsPoses) {
  Member watcher = join(), lost = join();
  ASSERT_TRUE(pose(lost, 1).has_value());
  inputs();
  lose(lost);
  pass(1s);
  const Member back = comeBack(lost);
  EXPECT_TRUE(back.admission.resumed);
  EXPECT_EQ(back.admission.id, 2u);
  EXPECT_EQ(back.admission.token, lost.admission.token);
  EXPECT_THAT(idsOf(back.admission), ElementsAre(1, 2));
  EXPECT_FALSE(back.admission.participants[1].away);
  EXPECT_THAT(watcher.heard(), ElementsAre("joined 2", "away 2", "back 2"));
  pass(10min);
  EXPECT_THAT(inputs(), IsEmpty());
  EXPECT_EQ(roster.size(), 2u);
}

TEST_F(RosterTest, LaterReconnectRestoresCollidersAndGrabs) {
  const Member lost = join(Role::owner);
  ASSERT_TRUE(pose(lost, 1).has_value());
  lose(lost);
  pass(59999ms);
  EXPECT_THAT(inputs(), ElementsAre("1: 0 colliders, 0 grabs"));
  const Member back = join(Role::viewer, lost.admission.token);  // the role is kept, whatever is requested
  EXPECT_TRUE(back.admission.resumed);
  EXPECT_EQ(back.admission.role, Role::owner);
  EXPECT_THAT(inputs(), ElementsAre("1: 1 colliders, 1 grabs"));
}

TEST_F(RosterTest, ReconnectAfterTheGracePeriodJoinsAgain) {
  const Member lost = join();
  lose(lost);
  now += 60s;  // expire() was not called yet
  const Member late = comeBack(lost);
  EXPECT_FALSE(late.admission.resumed);
  EXPECT_EQ(late.admission.id, 2u);
  EXPECT_NE(late.admission.token, lost.admission.token);
}

TEST_F(RosterTest, RefusesAnOlderConnectionAttempt) {
  const Member lost = join();
  lose(lost);
  Member third, second, fourth;
  ASSERT_TRUE(tryJoin(third, {}, lost.admission.token, 3).has_value());
  EXPECT_EQ(tryJoin(second, {}, lost.admission.token, 2).error(), Roster::Refusal::late);
  EXPECT_FALSE(third.mailbox->closed());
  EXPECT_TRUE(tryJoin(fourth, {}, lost.admission.token, 4).has_value());
  EXPECT_TRUE(third.mailbox->closed());
}

TEST_F(RosterTest, TokenIsInvalidAfterLeavingAndCannotBeGuessed) {
  const Member gone = join(), there = join();
  leave(gone);
  EXPECT_FALSE(comeBack(gone).admission.resumed);
  EXPECT_THAT(there.admission.token, SizeIs(kTokenBytes));
  std::string guess = there.admission.token;
  guess.back() = static_cast<char>(guess.back() ^ 1);
  for (const std::string& wrong : {guess, there.admission.token.substr(1), there.admission.token + "x"})
    EXPECT_FALSE(join({}, wrong).admission.resumed);
}

TEST_F(RosterTest, SecondConnectionTakesOverAndClosesTheFirst) {
  Member watcher = join(), old = join();
  ASSERT_TRUE(pose(old, 1).has_value());
  inputs();
  const Member fresh = comeBack(old);
  EXPECT_EQ(fresh.admission.id, 2u);
  EXPECT_TRUE(old.mailbox->closed());
  const auto last = old.read();
  ASSERT_EQ(last.size(), 1u);
  EXPECT_EQ(last[0].error().code(), v1::ERROR_CODE_TAKEN_OVER);
  EXPECT_TRUE(last[0].error().fatal());
  // Calls of the old connection have no effect.
  EXPECT_TRUE(pose(old, 3).has_value());
  EXPECT_FALSE(roster.permits(*old.mailbox, Action::collide, {}).has_value());
  lose(old);
  leave(old);
  EXPECT_THAT(inputs(), IsEmpty());
  EXPECT_THAT(watcher.heard(), ElementsAre("joined 2"));
  EXPECT_TRUE(pose(fresh, 3).has_value());
  EXPECT_THAT(inputs(), SizeIs(1));
}

TEST_F(RosterTest, EvictsTheLongestDisconnectedWhenFull) {
  limit = 3;
  Member watcher = join();
  const Member first = join(), second = join();
  Member third, fourth;
  ASSERT_FALSE(tryJoin(third).has_value());
  EXPECT_EQ(tryJoin(third).error(), Roster::Refusal::full);
  lose(first);
  now += 1s;
  lose(second);
  EXPECT_TRUE(comeBack(second).admission.resumed);
  watcher.heard();
  ASSERT_TRUE(tryJoin(third).has_value());
  EXPECT_THAT(watcher.heard(), ElementsAre("left 2 timed out", "joined 4"));
  EXPECT_FALSE(tryJoin(fourth).has_value());
  EXPECT_FALSE(tryJoin(fourth, {}, first.admission.token).has_value());
}

TEST_F(RosterTest, OneAddressCannotHoldAllPlaces) {
  limit = 4;
  std::vector<Member> members(6);
  const auto from = [&](std::size_t member, const char* address) {
    return roster.join({.address = address, .placesOfAddress = 2}, members[member].mailbox, ids, limit, now);
  };
  const auto first = from(0, "192.0.2.1");
  ASSERT_TRUE(first);
  ASSERT_TRUE(from(1, "192.0.2.1"));
  EXPECT_EQ(from(2, "192.0.2.1").error(), Roster::Refusal::addressHasMany);
  EXPECT_TRUE(from(2, "192.0.2.2"));
  // A disconnected participant makes room for others of its address, and comes back while there is room.
  lose(members[0]);
  EXPECT_TRUE(from(3, "192.0.2.1"));
  EXPECT_EQ(roster.size(), 3u);
  EXPECT_EQ(from(4, "192.0.2.1").error(), Roster::Refusal::addressHasMany);
  EXPECT_FALSE(roster.knows(first->token));
  EXPECT_TRUE(from(4, "")) << "programs of this machine have no such limit";
  EXPECT_EQ(from(5, "").error(), Roster::Refusal::full);
}

TEST_F(RosterTest, APlaceBelongsToTheAddressFromWhichItsParticipantCameBack) {
  std::vector<Member> members(4);
  const auto from = [&](std::size_t member, const char* address, const std::string& token = "") {
    return roster.join({.token = token, .address = address, .placesOfAddress = 1}, members[member].mailbox,
                       ids, limit, now);
  };
  const auto first = from(0, "192.0.2.1");
  ASSERT_TRUE(first);
  lose(members[0]);
  const auto back = from(1, "192.0.2.2", first->token);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->resumed);
  EXPECT_EQ(from(2, "192.0.2.2").error(), Roster::Refusal::addressHasMany);
  EXPECT_TRUE(from(3, "192.0.2.1"));
}

TEST_F(RosterTest, WithoutGracePeriodDisconnectRemovesAtOnce) {
  Member watcher = join(), lost = join();
  ASSERT_TRUE(pose(lost, 1).has_value());
  roster.disconnect(*lost.mailbox, {0s, 2s}, now);
  EXPECT_THAT(watcher.heard(), ElementsAre("joined 2", "left 2 timed out"));
  EXPECT_FALSE(comeBack(lost).admission.resumed);
}

TEST_F(RosterTest, GuestsThatComeAndGoDoNotDisconnectASlowReader) {
  Member slow = join(Role::viewer), owner = join();
  for (int i = 0; i < 3000; ++i) {
    const Member guest = join();
    leave(guest);
    owner.read();
  }
  ASSERT_FALSE(slow.mailbox->closed());
  std::set<std::uint64_t> present;
  std::size_t messages = 0;
  for (const v1::ServerMessage& message : slow.read()) {
    ++messages;
    if (message.presence().kind() == v1::PRESENCE_KIND_JOINED)
      present.insert(message.presence().participant().id());
    if (message.presence().kind() == v1::PRESENCE_KIND_LEFT)
      present.erase(message.presence().participant().id());
  }
  EXPECT_LT(messages, 3000u);
  EXPECT_THAT(present, ElementsAre(2u)) << "the owner";
}

TEST_F(RosterTest, ClosedSceneRefusesJoins) {
  const Member first = join(), away = join();
  lose(away);
  roster.close(delivery::notice(v1::NOTICE_KIND_SCENE_DELETED, "gone", 0));
  EXPECT_EQ(roster.size(), 0u);
  EXPECT_TRUE(first.mailbox->closed());
  Member late;
  EXPECT_EQ(tryJoin(late).error(), Roster::Refusal::closed);
  EXPECT_EQ(tryJoin(late, {}, away.admission.token).error(), Roster::Refusal::closed);
}

}  // namespace
}  // namespace clothstream::scene
