// SPDX-License-Identifier: MIT
// Surfaces of the real room: parts, order, windows, reconnects, and servers that take none.
#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/stream/own_surfaces.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::string welcomeWith(const ScriptedServer& server, v1::SurfacePolicy policy,
                        v1::Role role = v1::ROLE_PARTICIPANT, bool resumed = false) {
  v1::ServerMessage message;
  message.ParseFromString(server.welcome());
  message.mutable_welcome()->set_role(role);
  message.mutable_welcome()->set_resumed(resumed);
  message.mutable_welcome()->set_resume_token("0123456789abcdef");
  message.mutable_welcome()->set_hold_ms(60'000);
  if (policy != v1::SURFACE_POLICY_UNSPECIFIED)
    message.mutable_welcome()->mutable_surfaces()->set_policy(policy);
  return message.SerializeAsString();
}

class Surfaces : public ::testing::Test {
 protected:
  Surfaces() {
    // Large enough for three parts of vertices and five of triangles.
    for (std::uint32_t i = 0; i < 10'000; ++i)
      for (const float number : {static_cast<float>(i), 1.0f, -2.0f}) positions.push_back(number);
    for (std::uint32_t i = 0; i < 3 * 17'000; ++i) triangles.push_back(i % 10'000);
  }
  std::uint32_t join(v1::SurfacePolicy policy, v1::Role role = v1::ROLE_PARTICIPANT, bool resumed = false) {
    const std::uint32_t received = client.receive(welcomeWith(server, policy, role, resumed), now);
    client.receiveAll(server.chunks(), now);
    client.receive(server.frame(++tick, codec::PacketKind::key), now);
    return received;
  }
  cs_surface surface(std::uint32_t id, std::uint32_t triangleCount, std::uint32_t vertexCount = 3) const {
    cs_surface made{};
    made.version = CS_SURFACE_VERSION;
    made.id = id;
    made.position[1] = 2;
    made.positions = positions.data();
    made.vertex_count = vertexCount;
    made.triangles = triangles.data();
    made.triangle_count = triangleCount;
    made.friction = 0.5f;
    return made;
  }
  int set(std::uint32_t id, std::uint32_t triangleCount = 1, std::uint32_t vertexCount = 3) {
    const cs_surface made = surface(id, triangleCount, vertexCount);
    return cs_set_surface(client.get(), &made);
  }
  // Messages about surfaces that the client sends now.
  std::vector<v1::SurfaceUpdate> sent() {
    std::vector<v1::SurfaceUpdate> updates;
    for (const v1::ClientMessage& message : client.outgoing())
      if (message.has_surface()) updates.push_back(message.surface());
    return updates;
  }
  static std::string textOf(const v1::SurfaceUpdate& update) {
    const std::string id = std::to_string(update.id());
    if (update.remove()) return id + " removed";
    if (update.has_part())
      return id + " " + std::to_string(update.part().index()) + "/" + std::to_string(update.part().count());
    if (!update.has_keep()) return id + " moves";
    std::string kept = "only";
    for (const std::uint32_t one : update.keep().ids()) kept += " " + std::to_string(one);
    return kept;
  }
  // The same over the next seconds, as text: "id part/count", "id moves", "id removed", or "only id id".
  std::vector<std::string> allSent() {
    std::vector<std::string> texts;
    for (int window = 0; window < 20; ++window) {
      for (const v1::SurfaceUpdate& update : sent()) texts.push_back(textOf(update));
      now += OwnSurfaces::kWindowUs;
      cs_update(client.get(), now);
    }
    return texts;
  }
  void reconnect(v1::SurfacePolicy policy, bool resumed = false) {
    cs_disconnected(client.get(), now);
    cs_connecting(client.get(), now);
    client.outgoing();
    events = join(policy, v1::ROLE_PARTICIPANT, resumed);
  }

  ScriptedServer server;
  ClientUnderTest client;
  std::vector<float> positions;
  std::vector<std::uint32_t> triangles;
  std::uint64_t now = 1'000'000, tick = 0;
  std::uint32_t events = 0;
};

TEST_F(Surfaces, AreSentInPartsOfAFewMessagesAtATime) {
  join(v1::SURFACE_POLICY_OWN);
  EXPECT_EQ(cs_get_surface_policy(client.get()), CS_SURFACES_OWN);
  ASSERT_EQ(set(5, 17'000, 10'000), 1);
  std::vector<float> gotPositions;
  std::vector<std::uint32_t> gotTriangles;
  std::uint32_t parts = 0;
  for (int window = 0; window < 2; ++window) {
    const std::vector<v1::SurfaceUpdate> updates = sent();
    EXPECT_EQ(updates.size(), OwnSurfaces::kWindow);
    for (const v1::SurfaceUpdate& update : updates) {
      EXPECT_LT(update.ByteSizeLong(), 60'000u);
      EXPECT_EQ(update.id(), 5u);
      EXPECT_EQ(update.part().index(), parts++);
      EXPECT_EQ(update.part().count(), 8u);
      EXPECT_EQ(update.has_pose(), update.part().index() == 0);
      EXPECT_EQ(update.part().has_friction(), update.part().index() == 0);
      gotPositions.insert(gotPositions.end(), update.part().positions().begin(),
                          update.part().positions().end());
      gotTriangles.insert(gotTriangles.end(), update.part().triangles().begin(),
                          update.part().triangles().end());
    }
    EXPECT_THAT(sent(), IsEmpty());
    now += OwnSurfaces::kWindowUs;
    cs_update(client.get(), now);
  }
  EXPECT_EQ(gotPositions, positions);
  EXPECT_EQ(gotTriangles, triangles);
  EXPECT_THAT(sent(), IsEmpty());
}

TEST_F(Surfaces, CarryPoseAndProperties) {
  join(v1::SURFACE_POLICY_OWN);
  cs_surface desk = surface(2, 1);
  desk.two_sided = 1;
  desk.orientation[3] = 1;
  ASSERT_EQ(cs_set_surface(client.get(), &desk), 1);
  const std::vector<v1::SurfaceUpdate> updates = sent();
  ASSERT_EQ(updates.size(), 2u);
  EXPECT_EQ(updates[0].pose().position().y(), 2);
  EXPECT_EQ(updates[0].pose().orientation().w(), 1);
  EXPECT_TRUE(updates[0].part().two_sided());
  EXPECT_EQ(updates[0].part().friction(), 0.5f);
}

TEST_F(Surfaces, MoveAndGo) {
  join(v1::SURFACE_POLICY_OWN);
  const float place[3] = {1, 2, 3};
  EXPECT_EQ(cs_move_surface(client.get(), 1, place, nullptr), 0);
  EXPECT_EQ(cs_remove_surface(client.get(), 1), 0);
  set(1);
  EXPECT_EQ(cs_move_surface(client.get(), 1, place, nullptr), 1);  // goes along with the mesh
  std::vector<v1::SurfaceUpdate> updates = sent();
  ASSERT_EQ(updates.size(), 2u);
  EXPECT_EQ(updates[0].pose().position().z(), 3);
  EXPECT_EQ(cs_move_surface(client.get(), 1, place, nullptr), 1);
  EXPECT_EQ(cs_remove_surface(client.get(), 1), 1);
  EXPECT_THAT(allSent(), ElementsAre("1 removed"));
  EXPECT_EQ(cs_move_surface(client.get(), 1, place, nullptr), 0);
}

TEST_F(Surfaces, StopSendingAMeshWhenItIsReplaced) {
  join(v1::SURFACE_POLICY_OWN);
  set(1, 17'000, 10'000);
  EXPECT_EQ(sent().size(), 4u);
  set(1);
  EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2"));
}

TEST_F(Surfaces, AreSentAgainAfterAReconnect) {
  set(1);
  set(2);
  join(v1::SURFACE_POLICY_OWN);
  EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2", "2 0/2", "2 1/2"));
  cs_remove_surface(client.get(), 1);
  set(2, 17'000, 10'000);
  EXPECT_EQ(sent().size(), 4u);  // and then the connection is lost
  reconnect(v1::SURFACE_POLICY_OWN);
  EXPECT_EQ(events & CS_EVENT_ERROR, 0u);
  EXPECT_THAT(allSent(), ElementsAre("2 0/8", "2 1/8", "2 2/8", "2 3/8", "2 4/8", "2 5/8", "2 6/8", "2 7/8"));
}

// The server has kept the surfaces meanwhile.
TEST_F(Surfaces, EndIfTheyWereRemovedWhileTheClientWasAway) {
  join(v1::SURFACE_POLICY_OWN);
  for (const std::uint32_t id : {1u, 2u, 3u}) set(id);
  allSent();
  cs_remove_surface(client.get(), 1);
  sent();  // and this is lost with the connection
  cs_disconnected(client.get(), now);
  cs_remove_surface(client.get(), 3);
  reconnect(v1::SURFACE_POLICY_OWN, true);
  EXPECT_THAT(allSent(), ElementsAre("only 2", "2 0/2", "2 1/2"));
}

TEST_F(Surfaces, OfAnEarlierClientEnd) {
  ASSERT_EQ(cs_set_resume_token(client.get(), "30313233343536373839616263646566-1"), 1);
  cs_connecting(client.get(), now);
  client.outgoing();
  join(v1::SURFACE_POLICY_OWN, v1::ROLE_PARTICIPANT, true);
  EXPECT_THAT(allSent(), ElementsAre("only"));
}

TEST_F(Surfaces, WaitWhileTheParticipantIsAViewer) {
  join(v1::SURFACE_POLICY_OWN, v1::ROLE_VIEWER);
  EXPECT_EQ(set(1), 1);
  EXPECT_THAT(allSent(), IsEmpty());
  for (const v1::Role role : {v1::ROLE_PARTICIPANT, v1::ROLE_VIEWER, v1::ROLE_OWNER}) {
    v1::ServerMessage message;
    v1::Presence& presence = *message.mutable_presence();
    presence.set_kind(v1::PRESENCE_KIND_ROLE_CHANGED);
    v1::ServerMessage welcome;
    welcome.ParseFromString(server.welcome());
    presence.mutable_participant()->set_id(welcome.welcome().participant_id());
    presence.mutable_participant()->set_role(role);
    client.receive(message.SerializeAsString(), now);
    if (role == v1::ROLE_VIEWER)
      EXPECT_THAT(allSent(), IsEmpty());
    else
      EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2"));
  }
}

TEST_F(Surfaces, SayClearlyThatAServerTakesNone) {
  const struct {
    v1::SurfacePolicy policy;
    cs_surface_policy seen;
    const char* text;
  } servers[] = {{v1::SURFACE_POLICY_UNSPECIFIED, CS_SURFACES_UNKNOWN, "knows no surfaces of the real room"},
                 {v1::SURFACE_POLICY_OFF, CS_SURFACES_OFF, "--room-surfaces off"},
                 {v1::SURFACE_POLICY_EVERYONE, CS_SURFACES_EVERYONE, "which the program does not allow"}};
  join(v1::SURFACE_POLICY_OWN);
  for (const auto& one : servers) {
    set(1);
    reconnect(one.policy);
    EXPECT_NE(events & CS_EVENT_ERROR, 0u);
    EXPECT_EQ(cs_get_surface_policy(client.get()), one.seen);
    EXPECT_THAT(cs_error_text(client.get()), HasSubstr(one.text));
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
    EXPECT_EQ(set(2), 0);
    EXPECT_THAT(allSent(), IsEmpty());
    reconnect(v1::SURFACE_POLICY_OWN);
    EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2"));
  }
}

TEST_F(Surfaces, GoToEveryoneOnlyIfTheProgramAllowsIt) {
  cs_allow_surfaces(client.get(), CS_SURFACES_EVERYONE);
  ASSERT_EQ(set(1), 1);
  join(v1::SURFACE_POLICY_EVERYONE);
  EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2"));
  // Taken back, and sent again.
  cs_allow_surfaces(client.get(), CS_SURFACES_OWN);
  EXPECT_THAT(allSent(), ElementsAre("only"));
  EXPECT_EQ(set(2), 0);
  EXPECT_THAT(allSent(), IsEmpty());
  cs_allow_surfaces(client.get(), CS_SURFACES_EVERYONE);
  EXPECT_THAT(allSent(), ElementsAre("only 1", "1 0/2", "1 1/2"));
  // Taken back without a connection.
  cs_disconnected(client.get(), now);
  cs_allow_surfaces(client.get(), CS_SURFACES_OWN);
  reconnect(v1::SURFACE_POLICY_EVERYONE, true);
  EXPECT_THAT(allSent(), ElementsAre("only"));
  cs_allow_surfaces(client.get(), CS_SURFACES_EVERYONE);
  allSent();
  // A server that sends them to no client has them in any case.
  reconnect(v1::SURFACE_POLICY_OWN);
  EXPECT_THAT(allSent(), ElementsAre("1 0/2", "1 1/2"));
  cs_allow_surfaces(client.get(), CS_SURFACES_OWN);
  EXPECT_THAT(allSent(), IsEmpty());
}

TEST_F(Surfaces, RefuseWhatNoServerTakes) {
  cs_surface made = surface(1, 1);
  made.version = 2;
  EXPECT_EQ(cs_set_surface(client.get(), &made), 0);
  EXPECT_EQ(set(1, 0), 0);
  EXPECT_EQ(set(1, CS_MAX_SURFACE_TRIANGLES + 1), 0);
  EXPECT_EQ(set(1, 1, CS_MAX_SURFACE_VERTICES + 1), 0);
  join(v1::SURFACE_POLICY_OWN);
  EXPECT_THAT(allSent(), IsEmpty());
}

}  // namespace
}  // namespace clothstream::client
