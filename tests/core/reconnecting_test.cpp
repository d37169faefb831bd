// SPDX-License-Identifier: MIT
// Participants, roles, and reconnects after a lost connection, with a simulated clock.
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/stream/reconnection.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr std::uint64_t kSecond = 1'000'000, kNever = std::numeric_limits<std::uint64_t>::max();

// Welcome of the server, with participants and a resume token.
std::string welcome(const ScriptedServer& server, bool resumed = false, v1::Role role = v1::ROLE_OWNER) {
  v1::ServerMessage message;
  message.ParseFromString(server.welcome());
  v1::Welcome& body = *message.mutable_welcome();
  body.set_role(role);
  body.set_resume_token("0123456789abcdef");
  body.set_resumed(resumed);
  body.set_hold_ms(60'000);
  for (const std::uint64_t id : {7, 42}) {
    v1::Participant& participant = *body.add_participants();
    participant.set_id(id);
    participant.set_display_name(id == 42 ? "Ada" : "Ben");
    participant.set_client_name("test");
    participant.set_role(id == 42 ? role : v1::ROLE_PARTICIPANT);
  }
  return message.SerializeAsString();
}

std::string presence(v1::PresenceKind kind, std::uint64_t id, v1::Role role = v1::ROLE_PARTICIPANT,
                     v1::LeaveReason reason = v1::LEAVE_REASON_UNSPECIFIED, std::uint64_t by = 0) {
  v1::ServerMessage message;
  v1::Presence& body = *message.mutable_presence();
  body.set_kind(kind);
  body.set_reason(reason);
  body.set_by_participant_id(by);
  body.mutable_participant()->set_id(id);
  body.mutable_participant()->set_display_name("Cy");
  body.mutable_participant()->set_role(role);
  body.mutable_participant()->set_away(kind == v1::PRESENCE_KIND_DISCONNECTED);
  return message.SerializeAsString();
}

class Reconnecting : public ::testing::Test {
 protected:
  void join(v1::Role role = v1::ROLE_OWNER) {
    client.receive(welcome(server, false, role), now);
    client.receiveAll(server.chunks(), now);
    client.receive(server.frame(1, codec::PacketKind::key), now);
    client.outgoing();
  }
  void cutOff() {
    cs_disconnected(client.get(), now);
    ASSERT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  }
  v1::Hello connect() {
    cs_connecting(client.get(), now);
    const auto messages = client.outgoing();
    EXPECT_EQ(messages.size(), 1u);
    return messages.front().hello();
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    cs_participant participant;
    for (std::uint32_t i = 0; cs_get_participant(client.get(), i, &participant) != 0; ++i)
      all.emplace_back(participant.name);
    return all;
  }
  void setCollider(float x) {
    const cs_own_collider sphere = sphereAt(x, 0, 0, 0.1f);
    cs_set_colliders(client.get(), &sphere, 1, now);
    cs_grab grab{};
    grab.id = 5;
    cs_set_grabs(client.get(), &grab, 1, now);
  }

  std::uint64_t now = 100 * kSecond;
  ScriptedServer server;
  ClientUnderTest client;
};

TEST_F(Reconnecting, SendsNameAndRequestedRole) {
  cs_client_options options = optionsFor("flag");
  options.display_name = "Ada";
  options.role = CS_ROLE_VIEWER;
  const std::unique_ptr<cs_client, decltype(&cs_destroy)> named(cs_create(&options), &cs_destroy);
  std::size_t bytes = 0;
  const std::uint8_t* message = cs_next_outgoing(named.get(), &bytes);
  v1::ClientMessage hello;
  ASSERT_TRUE(hello.ParseFromArray(message, static_cast<int>(bytes)));
  EXPECT_EQ(hello.hello().display_name(), "Ada");
  EXPECT_EQ(hello.hello().role(), v1::ROLE_VIEWER);
  EXPECT_THAT(hello.hello().resume_token(), IsEmpty());
}

TEST_F(Reconnecting, TracksParticipants) {
  EXPECT_EQ(client.receive(welcome(server), now), static_cast<std::uint32_t>(CS_EVENT_PARTICIPANTS));
  client.receiveAll(server.chunks(), now);
  EXPECT_THAT(names(), ElementsAre("Ben", "Ada"));
  EXPECT_EQ(cs_get_role(client.get()), static_cast<std::uint32_t>(CS_ROLE_OWNER));
  cs_presence received;
  cs_participant who;
  EXPECT_EQ(cs_get_presence(client.get(), &received, &who), 0);
  constexpr auto kBoth = static_cast<std::uint32_t>(CS_EVENT_PARTICIPANTS | CS_EVENT_PRESENCE);
  EXPECT_EQ(client.receive(presence(v1::PRESENCE_KIND_JOINED, 50)), kBoth);
  EXPECT_THAT(names(), ElementsAre("Ben", "Ada", "Cy"));
  client.receive(presence(v1::PRESENCE_KIND_DISCONNECTED, 50));
  cs_participant participant;
  ASSERT_EQ(cs_get_participant(client.get(), 2, &participant), 1);
  EXPECT_EQ(participant.away, 1);
  EXPECT_EQ(cs_get_participant(client.get(), 3, &participant), 0);
  client.receive(presence(v1::PRESENCE_KIND_LEFT, 50, v1::ROLE_PARTICIPANT, v1::LEAVE_REASON_REMOVED, 42));
  EXPECT_THAT(names(), ElementsAre("Ben", "Ada"));
  ASSERT_EQ(cs_get_presence(client.get(), &received, &who), 1);
  EXPECT_EQ(received.kind, static_cast<std::uint32_t>(CS_PRESENCE_LEFT));
  EXPECT_EQ(received.reason, static_cast<std::uint32_t>(CS_LEAVE_REMOVED));
  EXPECT_EQ(received.by, 42u);
  EXPECT_EQ(cs_get_presence(client.get(), &received, nullptr), 1);
  EXPECT_STREQ(who.name, "Cy");
}

TEST_F(Reconnecting, SendsRoleChangesAndRemovals) {
  join();
  cs_set_role(client.get(), 7, CS_ROLE_VIEWER);
  cs_remove_participant(client.get(), 8);
  const auto messages = client.outgoing();
  ASSERT_EQ(messages.size(), 2u);
  EXPECT_EQ(messages[0].set_role().participant_id(), 7u);
  EXPECT_EQ(messages[0].set_role().role(), v1::ROLE_VIEWER);
  EXPECT_EQ(messages[1].remove_participant().participant_id(), 8u);
}

TEST_F(Reconnecting, ReturnsWithTokenAndRepeatsPoses) {
  join();
  setCollider(1);
  client.outgoing();
  cutOff();
  setCollider(2);  // not sent while disconnected
  EXPECT_THAT(client.outgoing(), IsEmpty());
  EXPECT_EQ(cs_vertex_count(client.get()), 63u);  // the last description can still be read
  const v1::Hello hello = connect();
  EXPECT_EQ(hello.resume_token(), "0123456789abcdef");
  EXPECT_EQ(hello.description_content_id(), 1u);
  EXPECT_EQ(hello.scene(), "curtain");
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  EXPECT_EQ(client.receive(welcome(server, true), now),
            static_cast<std::uint32_t>(CS_EVENT_PARTICIPANTS | CS_EVENT_RETURNED));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
  EXPECT_EQ(cs_resumed(client.get()), 1);
  const auto messages = client.outgoing();
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].collider_poses().colliders(0).pose().position().x(), 2);
  EXPECT_EQ(messages[0].collider_poses().grabs(0).id(), 5u);
  // No new description arrived: the previous one remains, and missed frames count as dropped.
  client.receive(server.frame(5, codec::PacketKind::key), now);
  EXPECT_EQ(client.statistics(now).tick, 5u);
  EXPECT_EQ(client.statistics(now).dropped, 3u);
}

TEST_F(Reconnecting, AcceptsNewDescriptionAfterReturning) {
  join();
  cutOff();
  connect();
  v1::ServerMessage other;
  other.ParseFromString(welcome(server, true));
  other.mutable_welcome()->set_description_content_id(9);
  EXPECT_EQ(client.receive(other.SerializeAsString(), now),
            static_cast<std::uint32_t>(CS_EVENT_PARTICIPANTS));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  const auto chunks = server.chunks(256 * 1024, 9);
  EXPECT_EQ(client.receive(chunks.back(), now),
            static_cast<std::uint32_t>(CS_EVENT_DESCRIPTION | CS_EVENT_RETURNED));
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
  cutOff();
  EXPECT_EQ(connect().description_content_id(), 9u);
}

TEST_F(Reconnecting, OffersNoDescriptionIfCutOffBeforeTheNewOne) {
  join();
  cutOff();
  connect();
  v1::ServerMessage other;
  other.ParseFromString(welcome(server, true));
  other.mutable_welcome()->set_description_content_id(9);
  client.receive(other.SerializeAsString(), now);
  cutOff();
  EXPECT_EQ(connect().description_content_id(), 0u);
}

TEST_F(Reconnecting, JoinsARestartedServerAsNewParticipant) {
  join();
  setCollider(1);
  client.outgoing();
  cutOff();
  connect();
  client.receive(welcome(server, false), now);
  // The content id is the same, but the server does not know this client.
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  client.receiveAll(server.chunks(), now);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
  EXPECT_EQ(cs_resumed(client.get()), 0);
  EXPECT_THAT(client.outgoing(), SizeIs(1));  // the poses are sent again
}

// A program that starts again, or a page that is loaded again.
TEST_F(Reconnecting, ReturnsAsTheParticipantOfAnEarlierClient) {
  EXPECT_STREQ(cs_resume_token(client.get()), "");
  join();
  const std::string first = cs_resume_token(client.get());
  cutOff();
  connect();
  client.receive(welcome(server, true), now);
  const std::string token = cs_resume_token(client.get());
  EXPECT_EQ(first, "30313233343536373839616263646566-1");
  EXPECT_EQ(token, "30313233343536373839616263646566-2");

  ClientUnderTest later;
  EXPECT_EQ(cs_set_resume_token(later.get(), token.c_str()), 1);
  cs_connecting(later.get(), now);
  const v1::Hello hello = later.outgoing().at(0).hello();
  EXPECT_EQ(hello.resume_token(), "0123456789abcdef");
  EXPECT_EQ(hello.attempt(), 4u) << "later than every connection of the earlier client";
  EXPECT_EQ(hello.description_content_id(), 0u);
  later.receive(welcome(server, true), now);
  EXPECT_EQ(cs_resumed(later.get()), 1);
  // The hands of the earlier client let go.
  const auto poses = later.outgoing();
  ASSERT_THAT(poses, SizeIs(1));
  EXPECT_TRUE(poses[0].has_collider_poses());
  EXPECT_THAT(poses[0].collider_poses().grabs(), IsEmpty());
  EXPECT_THAT(poses[0].collider_poses().colliders(), IsEmpty());
  for (const std::string& chunk : server.chunks())
    EXPECT_EQ(later.receive(chunk, now) & CS_EVENT_RETURNED, 0u);
  EXPECT_EQ(cs_get_state(later.get()), CS_STATE_JOINED);
}

TEST_F(Reconnecting, JoinsAsNewParticipantAfterTheGracePeriod) {
  join();
  ClientUnderTest later;
  ASSERT_EQ(cs_set_resume_token(later.get(), cs_resume_token(client.get())), 1);
  cs_connecting(later.get(), now);
  // The first attempt fails.
  cs_disconnected(later.get(), now);
  EXPECT_EQ(cs_get_state(later.get()), CS_STATE_JOINING);
  cs_connecting(later.get(), now);
  EXPECT_EQ(later.outgoing().at(0).hello().resume_token(), "0123456789abcdef");
  later.receive(welcome(server, false), now);
  EXPECT_EQ(cs_resumed(later.get()), 0);
  EXPECT_THAT(later.outgoing(), IsEmpty());
}

TEST_F(Reconnecting, RefusesWrongResumeTokens) {
  const std::string large = std::string(130, '3').append("-1");
  for (const char* wrong :
       {"-1", "30", "303-1", "3g-1", "30-", "30-x", "30-1x", "30--1", "+3-1", "30-4294967296", large.c_str()})
    EXPECT_EQ(cs_set_resume_token(client.get(), wrong), 0) << wrong;
  EXPECT_THAT(client.outgoing().at(0).hello().resume_token(), IsEmpty());
  ClientUnderTest other;
  EXPECT_EQ(cs_set_resume_token(other.get(), "30-1"), 1);
  EXPECT_EQ(cs_set_resume_token(other.get(), ""), 1);
  EXPECT_THAT(other.outgoing().at(0).hello().resume_token(), IsEmpty());
}

TEST_F(Reconnecting, RefusesFrameBeforeDescriptionAfterReturning) {
  join();
  cutOff();
  connect();
  client.receive(welcome(server, false), now);
  client.receive(server.frame(6, codec::PacketKind::key), now);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("before the description"));
}

TEST_F(Reconnecting, RetriesAtOnceThenOftenThenRarely) {
  join();
  EXPECT_EQ(cs_connect_at(client.get()), now + Reconnection::kSilenceUs);
  now += 3 * kSecond;
  const std::uint64_t lost = now;
  std::uint64_t before = 0, longest = 0;
  cs_disconnected(client.get(), now);
  EXPECT_EQ(cs_connect_at(client.get()), now);
  for (int attempts = 0; now < lost + 600 * kSecond; ++attempts) {
    cs_connecting(client.get(), now);
    EXPECT_EQ(cs_connect_at(client.get()), now + (now < lost + 60 * kSecond ? 2 : 10) * kSecond);
    cs_disconnected(client.get(), now);
    const std::uint64_t delay = cs_connect_at(client.get()) - now;
    if (now < lost + 60 * kSecond) {
      EXPECT_LE(delay, Reconnection::kLongestInGraceUs);
      longest = std::max(longest, delay);
    } else {
      EXPECT_LE(delay, Reconnection::kLongestUs);
      EXPECT_GE(delay, Reconnection::kLongestInGraceUs);
    }
    EXPECT_GE(delay, Reconnection::kShortestUs / 2);
    if (attempts == 0) {
      EXPECT_LE(delay, Reconnection::kShortestUs);
    }
    before = delay;
    now += delay;
  }
  EXPECT_GT(longest, Reconnection::kLongestInGraceUs * 3 / 4);
  EXPECT_GE(before, Reconnection::kLongestUs / 2);
}

TEST_F(Reconnecting, CountsAttempts) {
  join();
  cutOff();
  const std::uint32_t second = connect().attempt();
  EXPECT_GT(second, 1u);
  cutOff();
  EXPECT_GT(connect().attempt(), second);
}

TEST_F(Reconnecting, ReadsWaitingMessagesAfterAPauseBeforeGivingUp) {
  join();
  cs_update(client.get(), now);
  const std::uint64_t heard = now;
  for (; now < heard + kSecond; now += kSecond / 10) cs_update(client.get(), now);
  EXPECT_EQ(cs_connect_at(client.get()), heard + Reconnection::kSilenceUs);
  now += 60 * kSecond;
  cs_update(client.get(), now);
  EXPECT_GT(cs_connect_at(client.get()), now);
  // Silence between regular updates still counts.
  for (const std::uint64_t woke = now; now < woke + 4 * kSecond; now += kSecond / 10)
    cs_update(client.get(), now);
  EXPECT_LE(cs_connect_at(client.get()), now);
}

TEST_F(Reconnecting, SpreadsReconnectsOfManyClients) {
  std::set<std::uint64_t> delays;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Reconnection reconnection;
    for (int i = 0; i < 6; ++i) reconnection.lost(0, 60 * kSecond, seed);
    delays.insert(reconnection.lost(0, 60 * kSecond, seed));
  }
  EXPECT_GT(delays.size(), 15u);
}

TEST_F(Reconnecting, RetriesAtOnceOnlyAfterAStableConnection) {
  join();
  now += kSecond;
  cutOff();
  EXPECT_EQ(cs_connect_at(client.get()), now);
  connect();
  client.receive(welcome(server, true), now);
  now += kSecond;
  cutOff();
  EXPECT_GT(cs_connect_at(client.get()), now);
  connect();
  client.receive(welcome(server, true), now);
  now += 3 * kSecond;
  cutOff();
  EXPECT_EQ(cs_connect_at(client.get()), now);
}

TEST_F(Reconnecting, DoesNotRetryAFatalRefusal) {
  join();
  client.receive(ScriptedServer::error(v1::ERROR_CODE_REMOVED, "an owner removed this participant", true),
                 now);
  cs_disconnected(client.get(), now);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_EQ(cs_connect_at(client.get()), kNever);
  cs_connecting(client.get(), now);
  EXPECT_THAT(client.outgoing(), IsEmpty());
}

TEST_F(Reconnecting, RetriesAServerThatCutOffOrIsFull) {
  join();
  client.receive(ScriptedServer::error(v1::ERROR_CODE_CUT_OFF, "too much waits to be read", true), now);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
  cutOff();
  connect();
  client.receive(ScriptedServer::error(v1::ERROR_CODE_RESOURCE_EXHAUSTED, "full", true), now);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  cutOff();
  EXPECT_NE(cs_connect_at(client.get()), kNever);
}

TEST_F(Reconnecting, DropsRequestsWhileDisconnected) {
  join();
  cutOff();
  for (int i = 0; i < 1000; ++i) cs_set_gust(client.get(), 1, 1);
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_RECONNECTING);
  connect();
}

TEST_F(Reconnecting, SendsPosesOfAViewerWhenItsRoleAllows) {
  join(v1::ROLE_VIEWER);
  setCollider(1);
  cs_want_contacts(client.get(), 1, now);
  auto messages = client.outgoing();
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].collider_poses().colliders_size(), 0);
  EXPECT_EQ(messages[0].collider_poses().grabs_size(), 0);
  EXPECT_TRUE(messages[0].collider_poses().contact_events());
  client.receive(presence(v1::PRESENCE_KIND_ROLE_CHANGED, 42, v1::ROLE_PARTICIPANT), now);
  EXPECT_EQ(cs_get_role(client.get()), static_cast<std::uint32_t>(CS_ROLE_PARTICIPANT));
  messages = client.outgoing();
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_EQ(messages[0].collider_poses().colliders_size(), 1);
  EXPECT_EQ(messages[0].collider_poses().grabs_size(), 1);
}

}  // namespace
}  // namespace clothstream::client
