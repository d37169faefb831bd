// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of others: requests for their meshes, changes, and hostile answers.
#include "clients/core/stream/room_surfaces.h"

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::uint64_t kOwn = 40, kOther = 41;

class RoomSurfacesOfOthers : public ::testing::Test {
 protected:
  RoomSurfacesOfOthers() {
    cs_follow_surfaces(client.get(), 1);
    join();
  }
  std::uint32_t join() {
    v1::ServerMessage message;
    message.ParseFromString(server.welcome());
    message.mutable_welcome()->set_participant_id(kOwn);
    message.mutable_welcome()->mutable_surfaces()->set_policy(v1::SURFACE_POLICY_EVERYONE);
    const std::uint32_t received = client.receive(message.SerializeAsString(), now);
    client.receiveAll(server.chunks(), now);
    client.receive(server.frame(++tick, codec::PacketKind::key), now);
    client.outgoing();
    return received;
  }
  // A surface of `squares` squares: a strip with two triangles for each, in parts of one square.
  static v1::RoomSurface strip(std::uint64_t participant, std::uint32_t id, std::uint64_t revision,
                               std::uint32_t squares) {
    v1::RoomSurface surface;
    surface.set_participant_id(participant);
    surface.set_id(id);
    surface.set_revision(revision);
    surface.mutable_pose()->mutable_position()->set_y(0.75f);
    surface.set_vertex_count(4 * squares);
    surface.set_triangle_count(2 * squares);
    surface.set_part_count(squares);
    return surface;
  }
  static v1::SurfacePart square(std::uint32_t index) {
    v1::SurfacePart part;
    part.set_index(index);
    const auto x = static_cast<float>(index);
    for (const float number : {x, 0.0f, 0.0f, x, 0.0f, 1.0f, x + 1, 0.0f, 1.0f, x + 1, 0.0f, 0.0f})
      part.add_positions(number);
    for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u}) part.add_triangles(4 * index + corner);
    return part;
  }
  std::uint32_t list(const std::vector<v1::RoomSurface>& surfaces) {
    v1::ServerMessage message;
    message.mutable_room_surfaces();
    for (const v1::RoomSurface& surface : surfaces)
      *message.mutable_room_surfaces()->add_surfaces() = surface;
    return client.receive(message.SerializeAsString(), now);
  }
  // The request that the client sends now; at most one waits for an answer.
  std::optional<v1::ClientMessage> asked() {
    std::optional<v1::ClientMessage> found;
    for (const v1::ClientMessage& message : client.outgoing()) {
      if (!message.has_get_surface_part()) continue;
      EXPECT_FALSE(found);
      found = message;
    }
    return found;
  }
  std::uint32_t answer(const v1::ClientMessage& request, const v1::SurfacePart& part) {
    v1::ServerMessage message;
    message.set_request_id(request.request_id());
    *message.mutable_get_surface_part()->mutable_part() = part;
    return client.receive(message.SerializeAsString(), now);
  }
  std::uint32_t refuse(const v1::ClientMessage& request, v1::ErrorCode code) {
    v1::ServerMessage message;
    message.set_request_id(request.request_id());
    message.mutable_error()->set_code(code);
    return client.receive(message.SerializeAsString(), now);
  }
  // Answers all requests, over the next seconds. Returns what was asked for, as "participant id revision
  // index".
  std::vector<std::string> answerAll(std::uint32_t* events = nullptr) {
    std::vector<std::string> texts;
    for (int window = 0; window < 20; ++window) {
      while (const std::optional<v1::ClientMessage> request = asked()) {
        const v1::GetSurfacePartRequest& part = request->get_surface_part();
        texts.push_back(std::to_string(part.participant_id()) + " " + std::to_string(part.id()) + " " +
                        std::to_string(part.revision()) + " " + std::to_string(part.index()));
        const std::uint32_t received = answer(*request, square(part.index()));
        if (events != nullptr) *events |= received;
      }
      now += RoomSurfaces::kWindowUs;
      cs_update(client.get(), now);
    }
    return texts;
  }
  cs_room_surface at(std::uint32_t index) {
    cs_room_surface surface{};
    surface.version = CS_ROOM_SURFACE_VERSION;
    EXPECT_EQ(cs_get_room_surface(client.get(), index, &surface), 1);
    return surface;
  }
  std::uint32_t count() { return cs_room_surface_count(client.get()); }

  ScriptedServer server;
  ClientUnderTest client;
  std::uint64_t now = 1'000'000, tick = 0;
};

TEST_F(RoomSurfacesOfOthers, AreAskedForPartByPartButNotTheOwnOnes) {
  EXPECT_EQ(list({strip(kOwn, 1, 1, 1), strip(kOther, 5, 2, 2), strip(kOther, 6, 3, 1)}) & CS_EVENT_SURFACES,
            0u);
  EXPECT_EQ(count(), 0u);
  std::uint32_t events = 0;
  EXPECT_THAT(answerAll(&events), ElementsAre("41 5 2 0", "41 5 2 1", "41 6 3 0"));
  EXPECT_NE(events & CS_EVENT_SURFACES, 0u);
  ASSERT_EQ(count(), 2u);
  const cs_room_surface surface = at(0);
  EXPECT_EQ(surface.participant_id, kOther);
  EXPECT_EQ(surface.id, 5u);
  EXPECT_EQ(surface.revision, 2u);
  EXPECT_EQ(surface.position[1], 0.75f);
  EXPECT_EQ(surface.vertex_count, 8u);
  ASSERT_EQ(surface.triangle_count, 4u);
  EXPECT_EQ(surface.positions[3 * 7], 2);
  EXPECT_EQ(surface.triangles[11], 7u);
  cs_room_surface wrong{};
  wrong.version = CS_ROOM_SURFACE_VERSION + 1;
  EXPECT_EQ(cs_get_room_surface(client.get(), 0, &wrong), 0);
  wrong.version = CS_ROOM_SURFACE_VERSION;
  EXPECT_EQ(cs_get_room_surface(client.get(), 2, &wrong), 0);
}

TEST_F(RoomSurfacesOfOthers, AreNotAskedForByDefault) {
  cs_follow_surfaces(client.get(), 0);
  list({strip(kOther, 5, 2, 2)});
  EXPECT_THAT(answerAll(), IsEmpty());
  EXPECT_EQ(count(), 0u);
}

TEST_F(RoomSurfacesOfOthers, AreAskedForAFewPartsAtATime) {
  list({strip(kOther, 5, 2, 20)});
  for (std::uint32_t sent = 0; sent < RoomSurfaces::kWindow; ++sent) {
    const std::optional<v1::ClientMessage> request = asked();
    ASSERT_TRUE(request);
    EXPECT_FALSE(asked()) << "one request at a time";
    answer(*request, square(sent));
  }
  EXPECT_FALSE(asked());
  now += RoomSurfaces::kWindowUs;
  cs_update(client.get(), now);
  EXPECT_TRUE(asked());
}

TEST_F(RoomSurfacesOfOthers, FollowChanges) {
  list({strip(kOther, 5, 2, 1), strip(kOther, 6, 3, 1)});
  answerAll();
  // A new pose needs no mesh, the same list is no change, a new revision is asked for, and one that is gone
  // goes.
  v1::RoomSurface moved = strip(kOther, 5, 2, 1);
  moved.mutable_pose()->mutable_position()->set_y(1);
  EXPECT_NE(list({moved, strip(kOther, 6, 3, 1)}) & CS_EVENT_SURFACES, 0u);
  EXPECT_EQ(at(0).position[1], 1);
  EXPECT_EQ(list({moved, strip(kOther, 6, 3, 1)}) & CS_EVENT_SURFACES, 0u);
  EXPECT_THAT(answerAll(), IsEmpty());
  EXPECT_NE(list({moved, strip(kOther, 6, 4, 2)}) & CS_EVENT_SURFACES, 0u);
  EXPECT_EQ(count(), 1u);
  EXPECT_THAT(answerAll(), ElementsAre("41 6 4 0", "41 6 4 1"));
  EXPECT_EQ(count(), 2u);
  EXPECT_NE(list({}) & CS_EVENT_SURFACES, 0u);
  EXPECT_EQ(count(), 0u);
}

TEST_F(RoomSurfacesOfOthers, AreForgottenWhenTheClientReturns) {
  list({strip(kOther, 5, 2, 1)});
  answerAll();
  list({strip(kOther, 5, 2, 1), strip(kOther, 6, 3, 2)});
  ASSERT_TRUE(asked());
  cs_disconnected(client.get(), now);
  cs_connecting(client.get(), now);
  client.outgoing();
  EXPECT_NE(join() & CS_EVENT_SURFACES, 0u);
  EXPECT_EQ(count(), 0u);
  list({strip(kOther, 5, 9, 1)});
  EXPECT_THAT(answerAll(), ElementsAre("41 5 9 0"));
}

TEST_F(RoomSurfacesOfOthers, ARefusedMeshIsLeftOutAndALateOneIsTriedAgain) {
  list({strip(kOther, 5, 2, 1), strip(kOther, 6, 3, 1)});
  EXPECT_EQ(refuse(*asked(), v1::ERROR_CODE_NOT_FOUND), 0u);
  const std::optional<v1::ClientMessage> second = asked();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->get_surface_part().id(), 6u);
  EXPECT_EQ(refuse(*second, v1::ERROR_CODE_RATE_LIMITED), 0u);
  EXPECT_FALSE(asked());
  EXPECT_THAT(answerAll(), ElementsAre("41 6 3 0"));
  EXPECT_EQ(count(), 1u);
}

TEST_F(RoomSurfacesOfOthers, HostileAnswersGiveNoSurface) {
  const v1::RoomSurface surface = strip(kOther, 5, 2, 1);
  std::vector<v1::SurfacePart> parts(6, square(0));
  parts[0].set_positions(4, NAN);
  parts[1].set_triangles(2, 4);  // no such vertex
  parts[2].add_positions(1);     // more than the list says
  parts[3].add_triangles(1);
  parts[4].clear_triangles();  // fewer
  parts[5].clear_positions();
  std::uint64_t revision = 10;
  for (const v1::SurfacePart& part : parts) {
    v1::RoomSurface listed = surface;
    listed.set_revision(++revision);
    list({listed});
    const std::optional<v1::ClientMessage> request = asked();
    ASSERT_TRUE(request);
    EXPECT_EQ(answer(*request, part) & CS_EVENT_SURFACES, 0u);
    EXPECT_EQ(count(), 0u);
    EXPECT_THAT(answerAll(), IsEmpty()) << "it is not asked for again";
  }
  // Answers that nothing waits for, and surfaces beyond what a scene may have.
  v1::ClientMessage unknown;
  unknown.set_request_id(999);
  EXPECT_EQ(answer(unknown, square(0)), 0u);
  v1::RoomSurface huge = strip(kOther, 7, 30, 1);
  huge.set_vertex_count(4'000'000'000);
  v1::RoomSurface none = strip(kOther, 8, 31, 1);
  none.set_part_count(0);
  list({huge, none});
  EXPECT_THAT(answerAll(), IsEmpty());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_JOINED);
}

}  // namespace
}  // namespace clothstream::client
