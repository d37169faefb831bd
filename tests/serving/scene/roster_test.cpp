// SPDX-License-Identifier: MIT
// Participants of a scene: roles, presence and reconnection, with a simulated clock.
#include "server/scene/roster.h"

#include <atomic>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/small_scene.h"

namespace clothstream::scene {
namespace {

using namespace schedule;
using namespace delivery;

using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// ---- Permissions

struct ActionCase {
  Action action;
  Role needed;      // if participants may change all parameters
  Role restricted;  // if participants may change none
};

TEST(Roles, EachActionRequiresItsRole) {
  const ActionCase cases[] = {
      {Action::collide, Role::participant, Role::participant},
      {Action::grab, Role::participant, Role::participant},
      {Action::moveAttachments, Role::participant, Role::participant},
      {Action::changeEnvironment, Role::participant, Role::owner},
      {Action::changeCloths, Role::participant, Role::owner},
      {Action::changeColliders, Role::participant, Role::owner},
      {Action::controlScene, Role::owner, Role::owner},
      {Action::deleteScene, Role::owner, Role::owner},
      {Action::recordScene, Role::owner, Role::owner},
      {Action::setRole, Role::owner, Role::owner},
      {Action::removeParticipant, Role::owner, Role::owner},
  };
  for (const ActionCase& tried : cases)
    for (const bool may : {true, false})
      for (const Role role : {Role::viewer, Role::participant, Role::owner}) {
        const Role needed = may ? tried.needed : tried.restricted;
        const auto permitted = permit(role, tried.action, {may, may, may});
        EXPECT_EQ(permitted.has_value(), role >= needed) << static_cast<int>(tried.action) << nameOf(role);
        if (permitted) continue;
        EXPECT_EQ(permitted.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
        EXPECT_THAT(permitted.error().text, HasSubstr(fmt::format("requires the role {}; yours is {}",
                                                                  nameOf(needed), nameOf(role))));
      }
}

TEST(Roles, ChangeRequiresTheRoleOfItsContent) {
  const auto parts = [](const v1::ParameterChange& change, const Permissions& permissions) {
    return permit(Role::participant, change, permissions).has_value();
  };
  v1::ParameterChange wind, gust, cloth, ball, both;
  wind.mutable_wind();
  gust.mutable_gust();
  cloth.add_cloths();
  ball.add_colliders();
  both.add_cloths();
  both.mutable_gravity();
  for (const v1::ParameterChange* change : {&wind, &gust}) {
    EXPECT_TRUE(parts(*change, {true, false, false}));
    EXPECT_FALSE(parts(*change, {false, true, true}));
  }
  EXPECT_TRUE(parts(cloth, {false, true, false}));
  EXPECT_FALSE(parts(cloth, {true, false, true}));
  EXPECT_TRUE(parts(ball, {false, false, true}));
  EXPECT_FALSE(parts(ball, {true, true, false}));
  EXPECT_FALSE(parts(both, {true, false, true}));
  EXPECT_FALSE(parts(both, {false, true, true}));
  EXPECT_FALSE(permit(Role::viewer, v1::ParameterChange(), Permissions()).has_value());
}

TEST(Roles, ViewerMayRequestContactEvents) {
  v1::ColliderPoses wish, hand, grab, knot;
  wish.set_contact_events(true);
  hand.add_colliders();
  grab.add_grabs();
  knot.add_attachments();
  EXPECT_TRUE(permit(Role::viewer, wish, {}).has_value());
  for (const v1::ColliderPoses* act : {&hand, &grab, &knot}) {
    EXPECT_FALSE(permit(Role::viewer, *act, {}).has_value());
    EXPECT_TRUE(permit(Role::participant, *act, {}).has_value());
  }
}

// ---- The roster

struct Member {
  Member() { mailbox->subscribe(nullptr, {.rate = 40}, *metrics); }

  std::vector<v1::ServerMessage> read() {
    std::vector<v1::ServerMessage> messages;
    while (const auto bytes = mailbox->next(Clock::time_point{}))
      messages.emplace_back().ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size()));
    return messages;
  }
  // Presence messages as text: "joined 2", "left 2 timed out", "role 3 owner by 1".
  std::vector<std::string> heard() {
    std::vector<std::string> lines;
    for (const v1::ServerMessage& message : read()) {
      const v1::Presence& presence = message.presence();
      constexpr const char* kKinds[] = {"?", "joined", "left", "role", "away", "back"};
      constexpr const char* kReasons[] = {"", "", " timed out", " removed"};
      const bool isRole = presence.kind() == v1::PRESENCE_KIND_ROLE_CHANGED;
      std::string line = fmt::format(
          "{} {}{}{}{}", kKinds[presence.kind()], presence.participant().id(), isRole ? " " : "",
          isRole ? nameOf(fromMessage(presence.participant().role())) : "", kReasons[presence.reason()]);
      if (presence.by_participant_id() != 0) line += fmt::format(" by {}", presence.by_participant_id());
      if (presence.kind() == v1::PRESENCE_KIND_DISCONNECTED ||
          presence.kind() == v1::PRESENCE_KIND_RETURNED) {
        EXPECT_EQ(presence.participant().away(), presence.kind() == v1::PRESENCE_KIND_DISCONNECTED);
      }
      lines.push_back(line);
    }
    return lines;
  }

  std::unique_ptr<telemetry::SceneMetrics> metrics = std::make_unique<telemetry::SceneMetrics>();
  std::shared_ptr<Mailbox> mailbox = std::make_shared<Mailbox>(nullptr);
  Roster::Admission admission;
};

// Subject of a token, and what the token permits.
struct Person {
  Subject subject;
  Rights rights{};
};

Person tokenOf(const char* subject, Ownership ownership, bool onlyViews = false) {
  return {.subject = {.tenant = {}, .name = subject},
          .rights = {.ownership = ownership, .onlyViews = onlyViews}};
}

class RosterTest : public ::testing::Test {
 protected:
  Member join(Role wanted = Role::none, const std::string& token = {}) {
    return join({.subject = {}, .rights = {}}, wanted, token);
  }
  Member join(const Person& person, Role wanted = Role::none, const std::string& token = {}) {
    Member member;
    auto admission = tryJoin(member, wanted, token, 0, person);
    EXPECT_TRUE(admission.has_value());
    if (admission) member.admission = std::move(*admission);
    return member;
  }
  tl::expected<Roster::Admission, Roster::Refusal> tryJoin(Member& member, Role wanted = {},
                                                           const std::string& token = {},
                                                           std::uint32_t attempt = 0,
                                                           const Person& person = {}) {
    return roster.join({.clientName = "test",
                        .displayName = "Ada",
                        .role = wanted,
                        .token = token,
                        .subject = person.subject,
                        .rights = person.rights,
                        .attempt = attempt},
                       member.mailbox, ids, limit, now);
  }
  Member comeBack(const Member& lost, const Person& person = {}) {
    return join(person, Role::none, lost.admission.token);
  }
  void lose(const Member& member) { roster.disconnect(*member.mailbox, {60s, 2s}, now); }
  void leave(const Member& member) { roster.leave(*member.mailbox, LeaveReason::left, now); }
  messages::Result<void> setRole(const Member& by, std::uint64_t id, Role role) {
    return setRole(by, id, toMessage(role));
  }
  messages::Result<void> setRole(const Member& by, std::uint64_t id, v1::Role role) {
    v1::SetRole message;
    message.set_participant_id(id);
    message.set_role(role);
    return roster.setRole(*by.mailbox, message, now);
  }
  messages::Result<void> remove(const Member& by, std::uint64_t id, bool ban = false) {
    v1::RemoveParticipant message;
    message.set_participant_id(id);
    message.set_ban(ban);
    return roster.remove(*by.mailbox, message, now);
  }
  messages::Result<void> pose(const Member& member, float x) {
    v1::ColliderPoses message;
    message.add_colliders();
    model::ParticipantPoses poses{.colliders = {tests::handAt(1, x)}, .grabs = {{.id = 4}}};
    return roster.post(*member.mailbox, message, poses, {}, now);
  }
  // Inputs of the next tick as text: "1: 1 colliders, 1 grabs".
  std::vector<std::string> inputs() {
    Inputs drained;
    inbox.drain(drained);
    std::vector<std::string> lines;
    for (const Poses& poses : drained.poses)
      lines.push_back(fmt::format("{}: {} colliders, {} grabs", poses.participant,
                                  poses.now.poses.colliders.size(), poses.now.poses.grabs.size()));
    return lines;
  }
  void pass(Clock::duration time) {
    now += time;
    roster.expire(now);
  }

  Clock::time_point now = Clock::time_point{} + 1000s;
  std::atomic<std::uint64_t> ids{0};
  std::size_t limit = 8;
  Subscribers subscribers;
  Inbox inbox;
  Roster roster{subscribers, inbox, nullptr};
};

std::vector<std::uint64_t> idsOf(const Roster::Admission& admission) {
  std::vector<std::uint64_t> all;
  for (const Participant& participant : admission.participants) all.push_back(participant.id);
  return all;
}

TEST_F(RosterTest, PoseTimesAreLimitedToAPlausibleRange) {
  const Member member = join();
  const auto trueAt = [&](std::int64_t laterUs) {
    v1::ColliderPoses message;
    message.set_client_time_us(77);
    message.set_server_time_us(microseconds(now) + static_cast<std::uint64_t>(laterUs));
    EXPECT_TRUE(roster.post(*member.mailbox, message, {}, {}, now));
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
  EXPECT_EQ(trueAt(-static_cast<std::int64_t>(microseconds(now))), std::nullopt) << "0: not known";
}

TEST_F(RosterTest, DismissDropsWaitingPoses) {
  const Member member = join();
  model::ParticipantPoses poses;
  poses.attachments.push_back({});
  EXPECT_TRUE(roster.post(*member.mailbox, {}, poses, {}, now));
  roster.dismiss(nullptr);
  EXPECT_TRUE(roster.post(*member.mailbox, {}, poses, {}, now));  // sent before the dismissal
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
  EXPECT_THAT(there.admission.token, SizeIs(Roster::kTokenBytes));
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
  Roster next(subscribers, inbox, nullptr);
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
  Roster next(subscribers, inbox, nullptr);
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
  Roster next(subscribers, inbox, nullptr);
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
  Roster next(subscribers, inbox, nullptr);
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

TEST_F(RosterTest, ClosedSceneRefusesJoins) {
  const Member first = join(), away = join();
  lose(away);
  roster.close(notice(v1::NOTICE_KIND_SCENE_DELETED, "gone", 0));
  EXPECT_EQ(roster.size(), 0u);
  EXPECT_TRUE(first.mailbox->closed());
  Member late;
  EXPECT_EQ(tryJoin(late).error(), Roster::Refusal::closed);
  EXPECT_EQ(tryJoin(late, {}, away.admission.token).error(), Roster::Refusal::closed);
}

}  // namespace
}  // namespace clothstream::scene
