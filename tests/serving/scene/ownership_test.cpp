// SPDX-License-Identifier: MIT
// Roles in a scene, without a roster.
#include "server/scene/ownership.h"

#include <cstddef>
#include <cstdint>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {
namespace {

using ::testing::HasSubstr;

ParticipantRecord inRole(std::uint64_t id, Role role, Ownership ownership = Ownership::ifNone,
                         const char* subject = "") {
  return {.participant = {.id = id, .displayName = {}, .clientName = {}, .role = role},
          .subject = {.tenant = {}, .name = subject},
          .rights = {.ownership = ownership}};
}

TEST(DemotedSubjects, ForgetTheOldest) {
  DemotedSubjects demoted;
  const auto subject = [](std::size_t i) { return Subject{.tenant = {}, .name = std::to_string(i)}; };
  for (std::size_t i = 0; i <= DemotedSubjects::kMax; ++i) demoted.remember(subject(i), Role::viewer);
  EXPECT_FALSE(demoted.contains(subject(0)));
  EXPECT_TRUE(demoted.contains(subject(1)));
  demoted.remember(subject(1), Role::participant);
  EXPECT_FALSE(demoted.contains(subject(1)));
  demoted.remember({}, Role::viewer);
  EXPECT_FALSE(demoted.contains({})) << "peers without a token are different";
}

TEST(Ownership, RightsDecideAboutTheFirstRole) {
  const ParticipantTable none, owned{inRole(1, Role::owner)};
  const Rights ifNone, never{.ownership = Ownership::never}, always{.ownership = Ownership::always};
  EXPECT_EQ(roleAtJoin(none, ifNone, Role::none), Role::owner);
  EXPECT_EQ(roleAtJoin(owned, ifNone, Role::owner), Role::participant);
  EXPECT_EQ(roleAtJoin(none, never, Role::owner), Role::participant);
  EXPECT_EQ(roleAtJoin(owned, always, Role::none), Role::owner);
  EXPECT_EQ(roleAtJoin(none, always, Role::viewer), Role::viewer);
  EXPECT_EQ(roleAtJoin(none, {.ownership = Ownership::always, .onlyViews = true}, Role::none), Role::viewer);
}

TEST(Ownership, RightsLowerARoleUnlessGranted) {
  ParticipantRecord record = inRole(1, Role::owner, Ownership::never);
  EXPECT_EQ(roleWithin(record), Role::participant);
  record.grantedRole = true;
  EXPECT_EQ(roleWithin(record), Role::owner);
  EXPECT_EQ(roleWithin(inRole(1, Role::viewer, Ownership::always)), Role::viewer) << "raises nothing";
}

TEST(Ownership, ConnectedParticipantsInheritFirst) {
  ParticipantTable table{inRole(1, Role::viewer), inRole(2, Role::participant, Ownership::never),
                         inRole(3, Role::participant), inRole(4, Role::participant)};
  EXPECT_EQ(findHeir(table)->id(), 3u);
  table[2].participant.away = true;
  EXPECT_EQ(findHeir(table)->id(), 4u);
  table[3].participant.away = true;
  EXPECT_EQ(findHeir(table)->id(), 3u);
  table.resize(2);
  EXPECT_EQ(findHeir(table), table.end());
}

TEST(Ownership, BanConcernsTheWholeSubject) {
  ParticipantTable table{
      inRole(1, Role::owner, Ownership::ifNone, "ada"), inRole(2, Role::participant, Ownership::never, "ben"),
      inRole(3, Role::viewer, Ownership::always, "ben"), inRole(4, Role::viewer, Ownership::never, "ada")};
  v1::RemoveParticipant message;
  const auto remove = [&](std::uint64_t id, bool ban) {
    message.set_participant_id(id);
    message.set_ban(ban);
    const auto removed = mayRemove(table, table[0], message);
    return removed ? std::to_string((*removed)->id()) : removed.error().text;
  };
  EXPECT_EQ(remove(2, false), "2");
  EXPECT_THAT(remove(2, true), HasSubstr("participantId = 3: is an owner by its token"));
  EXPECT_EQ(remove(4, false), "4");
  EXPECT_THAT(remove(4, true), HasSubstr("your own subject"));
}

}  // namespace
}  // namespace clothstream::scene
