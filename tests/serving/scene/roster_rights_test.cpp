// SPDX-License-Identifier: MIT
// Rights of participants: roles from owners and tokens, removal, bans, and participants of an earlier run.
#include <cstdint>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/roster.h"
#include "tests/serving/scene/roster_test.h"

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST_F(RosterTest, OwnerChangesRoles) {
  Member owner = join(), other = join();
  ASSERT_TRUE(pose(other, 1).has_value());
  inputs();
  ASSERT_TRUE(setRole(owner, 2, Role::viewer).has_value());
  EXPECT_THAT(inputs(), ElementsAre("2: 0 colliders, 0 grabs"));
  EXPECT_EQ(pose(other, 1).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_THAT(inputs(), IsEmpty());
  ASSERT_TRUE(setRole(owner, 2, Role::owner).has_value());
  ASSERT_TRUE(setRole(other, 1, Role::participant).has_value());
  EXPECT_THAT(other.heard(),
              ElementsAre("role 2 viewer by 1", "role 2 owner by 1", "role 1 participant by 2"));
  EXPECT_EQ(setRole(owner, 2, Role::viewer).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
}

TEST_F(RosterTest, RefusesInvalidRoleChangesWithTheReason) {
  const Member owner = join(), other = join();
  EXPECT_THAT(setRole(owner, 1, Role::viewer).error().text, HasSubstr("only owner"));
  EXPECT_THAT(setRole(owner, 99, Role::viewer).error().text, HasSubstr("setRole.participantId = 99"));
  EXPECT_EQ(setRole(owner, 99, Role::viewer).error().code, v1::ERROR_CODE_NOT_FOUND);
  for (const int role : {0, 4, -1})
    EXPECT_THAT(setRole(owner, 2, static_cast<v1::Role>(role)).error().text,
                HasSubstr("must be ROLE_VIEWER"));
  EXPECT_THAT(setRole(other, 1, Role::viewer).error().text, HasSubstr("requires the role owner"));
  EXPECT_EQ(remove(other, 1).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_EQ(remove(owner, 99).error().code, v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(RosterTest, RemovedParticipantCannotResume) {
  Member owner = join(), other = join(), away = join();
  ASSERT_TRUE(pose(other, 1).has_value());
  inputs();
  lose(away);
  owner.read();
  ASSERT_TRUE(remove(owner, 2).has_value());
  ASSERT_TRUE(remove(owner, 3).has_value());
  EXPECT_EQ(inputs().front(), "2: 0 colliders, 0 grabs");
  EXPECT_EQ(other.read().back().error().code(), v1::ERROR_CODE_REMOVED);
  EXPECT_TRUE(other.mailbox->closed());
  const auto announced = owner.read();
  ASSERT_EQ(announced.size(), 2u);
  EXPECT_EQ(announced[0].presence().reason(), v1::LEAVE_REASON_REMOVED);
  EXPECT_EQ(announced[0].presence().by_participant_id(), 1u);
  for (const Member* removed : {&other, &away}) {
    Member again;
    EXPECT_EQ(tryJoin(again, {}, removed->admission.token).error(), Roster::Refusal::removed);
  }
}

TEST_F(RosterTest, RestoredParticipantsOwnNothingBeforeTheyReturn) {
  const Person ada = tokenOf("ada", Ownership::always), ben = tokenOf("ben", Ownership::never);
  const Member owner = join(ada), other = join(ben);
  Roster next(subscribers, later, nullptr);
  next.restore(roster.saved(), {60s, 2s}, now);
  Member back;
  const auto admission = next.join({.clientName = {},
                                    .displayName = {},
                                    .token = owner.admission.token,
                                    .subject = ada.subject,
                                    .rights = ada.rights},
                                   back.mailbox, ids, limit, now);
  ASSERT_TRUE(admission.has_value());
  EXPECT_EQ(admission->role, Role::owner);
  next.leave(*back.mailbox, LeaveReason::left, now);
  EXPECT_FALSE(next.owned());
  Member participant;
  const auto second = next.join({.clientName = {},
                                 .displayName = {},
                                 .token = other.admission.token,
                                 .subject = ben.subject,
                                 .rights = ben.rights},
                                participant.mailbox, ids, limit, now);
  EXPECT_EQ(second->role, Role::participant);
}

TEST_F(RosterTest, RestoredParticipantThatMayOwnSucceedsWhenItReturns) {
  const Member owner = join(), other = join();
  Roster next(subscribers, later, nullptr);
  SavedRoster saved = roster.saved();
  std::erase_if(saved.participants,
                [&](const auto& known) { return known.participant.id == owner.admission.id; });
  next.restore(std::move(saved), {60s, 2s}, now);
  Member third, back;
  const auto came = next.join({.clientName = {},
                               .displayName = {},
                               .token = {},
                               .subject = {},
                               .rights = {.ownership = Ownership::never}},
                              third.mailbox, ids, limit, now);
  ASSERT_TRUE(came.has_value());
  EXPECT_EQ(came->role, Role::participant);
  EXPECT_FALSE(next.owned());
  const auto admission =
      next.join({.clientName = {}, .displayName = {}, .token = other.admission.token, .subject = {}},
                back.mailbox, ids, limit, now);
  ASSERT_TRUE(admission.has_value());
  EXPECT_EQ(admission->role, Role::owner);
}

// All participants of an earlier run have been away equally long.
TEST_F(RosterTest, OwnersAreEvictedLast) {
  const Member owner = join(), other = join();
  Roster next(subscribers, later, nullptr);
  next.restore(roster.saved(), {60s, 2s}, now);
  Member third, back;
  ASSERT_TRUE(next.join({}, third.mailbox, ids, 2, now).has_value());
  const auto admission =
      next.join({.clientName = {}, .displayName = {}, .token = owner.admission.token, .subject = {}},
                back.mailbox, ids, 2, now);
  ASSERT_TRUE(admission.has_value());
  EXPECT_TRUE(admission->resumed);
  EXPECT_EQ(admission->role, Role::owner);
}

TEST_F(RosterTest, ReturnWithALowerTokenLowersTheRole) {
  const Member watcher = join(tokenOf("watcher", Ownership::never));
  const Member owner = join(tokenOf("ada", Ownership::always));
  ASSERT_EQ(owner.admission.role, Role::owner);
  ASSERT_TRUE(pose(owner, 1).has_value());
  inputs();
  const Member participant = comeBack(owner, tokenOf("ada", Ownership::never));
  EXPECT_TRUE(participant.admission.resumed);
  EXPECT_EQ(participant.admission.role, Role::participant);
  EXPECT_EQ(participant.admission.participants[1].role, Role::participant);
  const Member viewer = comeBack(owner, tokenOf("ada", Ownership::never, true));
  EXPECT_EQ(viewer.admission.role, Role::viewer);
  EXPECT_THAT(inputs(), ElementsAre("2: 0 colliders, 0 grabs"));
  const Member again = comeBack(owner, tokenOf("ada", Ownership::always));
  EXPECT_EQ(again.admission.role, Role::viewer) << "a return raises no role";
}

TEST_F(RosterTest, NewTokenLowersTheRoleAndMakesAnother) {
  Member owner = join(), other = join();
  roster.renew(*owner.mailbox, {.ownership = Ownership::never}, now);
  EXPECT_THAT(other.heard(), ElementsAre("role 1 participant", "role 2 owner"));
  roster.renew(*other.mailbox, {.ownership = Ownership::never, .onlyViews = true}, now);
  EXPECT_THAT(owner.heard(), ElementsAre("joined 2", "role 1 participant", "role 2 owner", "role 2 viewer"));
  EXPECT_FALSE(roster.owned());
}

TEST_F(RosterTest, RoleThatAnOwnerGaveStaysWithTheSameToken) {
  const Person ben = tokenOf("ben", Ownership::never, true);
  const Member owner = join(tokenOf("ada", Ownership::always)), viewer = join(ben);
  ASSERT_TRUE(setRole(owner, 2, Role::owner).has_value());
  EXPECT_EQ(comeBack(viewer, ben).admission.role, Role::owner);
  Roster next(subscribers, later, nullptr);
  next.restore(roster.saved(), {60s, 2s}, now);
  Member back;
  const auto admission = next.join({.clientName = {},
                                    .displayName = {},
                                    .token = viewer.admission.token,
                                    .subject = ben.subject,
                                    .rights = ben.rights},
                                   back.mailbox, ids, limit, now);
  ASSERT_TRUE(admission.has_value());
  EXPECT_EQ(admission->role, Role::owner) << "also after a restart";
}

TEST_F(RosterTest, PromotedParticipantHasNoPowerOverAnOwnerByToken) {
  const Person ada = tokenOf("ada", Ownership::always);
  const Member owner = join(ada), second = join(ada, Role::viewer);
  const Member promoted = join(tokenOf("ben", Ownership::never));
  ASSERT_TRUE(setRole(owner, 3, Role::owner).has_value());
  for (const std::uint64_t id : {1, 2}) {
    EXPECT_EQ(remove(promoted, id).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
    EXPECT_EQ(remove(promoted, id, true).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
    EXPECT_THAT(setRole(promoted, id, Role::participant).error().text, HasSubstr("owner by its token"));
  }
  // A participant with a lower token of the same subject is no way to ban the owner.
  const Member lower = join(tokenOf("ada", Ownership::never));
  EXPECT_EQ(remove(promoted, 4, true).error().code, v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_TRUE(remove(promoted, 4).has_value());
  const Member other = join(tokenOf("cy", Ownership::always));
  EXPECT_TRUE(remove(other, 1, true).has_value());
}

TEST_F(RosterTest, SubjectsOfTwoTenantsAreDifferent) {
  Person ben = tokenOf("ben", Ownership::never), namesake = ben;
  namesake.subject.tenant = "school";
  const Member owner = join(tokenOf("ada", Ownership::always)), lost = join(ben);
  EXPECT_FALSE(comeBack(lost, namesake).admission.resumed);
  ASSERT_TRUE(remove(owner, 2, true).has_value());
  Member again, other;
  EXPECT_EQ(tryJoin(again, {}, {}, 0, ben).error(), Roster::Refusal::removed);
  EXPECT_TRUE(tryJoin(other, {}, {}, 0, namesake).has_value());
  EXPECT_FALSE(roster.isBanned(namesake.subject));
  EXPECT_TRUE(roster.liftBan("ben"));
  EXPECT_FALSE(roster.isBanned(ben.subject));
}

TEST_F(RosterTest, RefusesToBanAParticipantWithoutASubject) {
  const Member owner = join(), other = join();
  const auto banned = remove(owner, 2, true);
  EXPECT_EQ(banned.error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(banned.error().text, HasSubstr("has no subject"));
  EXPECT_FALSE(other.mailbox->closed());
}

TEST_F(RosterTest, DemotedSubjectStaysAViewerWhenItJoinsAgain) {
  const Person ben = tokenOf("ben", Ownership::never);
  const Member owner = join(tokenOf("ada", Ownership::always)), demoted = join(ben);
  ASSERT_TRUE(setRole(owner, 2, Role::viewer).has_value());
  leave(demoted);
  const Member again = join(ben);
  EXPECT_EQ(again.admission.role, Role::viewer);
  EXPECT_EQ(join(tokenOf("cy", Ownership::never)).admission.role, Role::participant);
  ASSERT_TRUE(setRole(owner, again.admission.id, Role::participant).has_value());
  leave(again);
  EXPECT_EQ(join(ben).admission.role, Role::participant) << "an owner has taken it back";
}

}  // namespace
}  // namespace clothstream::scene
