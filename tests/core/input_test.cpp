// SPDX-License-Identifier: MIT
// Colliders, hands, grabs and attachments sent to the server, and the events that it returns.
#include <array>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/stream/outbox.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(Colliders, AreSentWithTheirTime) {
  JoinedClient joined;
  const cs_own_collider spheres[] = {sphereAt(1, 2, 3, 0.1f), sphereAt(4, 5, 6, 0.2f)};
  cs_set_colliders(joined.client.get(), spheres, 2, 777);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  EXPECT_EQ(poses.client_time_us(), 777u);
  ASSERT_THAT(poses.colliders(), SizeIs(2));
  EXPECT_NE(poses.colliders(0).id(), poses.colliders(1).id());
  EXPECT_EQ(poses.colliders(1).pose().position().y(), 5);
  EXPECT_EQ(poses.colliders(1).sphere().radius(), 0.2f);
}

TEST(Colliders, AreSentWithServerTimeOnceKnown) {
  JoinedClient joined;
  const cs_own_collider sphere = sphereAt(1, 2, 3, 0.1f);
  cs_set_colliders(joined.client.get(), &sphere, 1, 5000);
  EXPECT_EQ(joined.sent().collider_poses().server_time_us(), 0u);
  cs_update(joined.client.get(), 10'000);
  ASSERT_TRUE(joined.sent().has_ping());
  // Round trip of 8 ms: the server's clock was at 1'000'000 when the client's was at 14'000.
  joined.client.receive(ScriptedServer::pong(10'000, 1'000'000), 18'000);
  cs_set_colliders(joined.client.get(), &sphere, 1, 24'000);
  EXPECT_EQ(joined.sent().collider_poses().server_time_us(), 1'010'000u);
  EXPECT_EQ(joined.client.statistics(24'000).clock_offset_us, 986'000);
}

TEST(Colliders, HandsAreSentAsJoints) {
  JoinedClient joined;
  std::vector<float> joints(std::size_t{4} * CS_HAND_JOINTS);
  for (std::size_t i = 0; i < joints.size(); ++i) joints[i] = static_cast<float>(i);
  EXPECT_EQ(cs_set_hand(joined.client.get(), CS_HAND_RIGHT, joints.data(), CS_HAND_JOINTS, 5), 1);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.hands(), SizeIs(1));
  EXPECT_EQ(poses.hands(0).side(), v1::HAND_SIDE_RIGHT);
  ASSERT_THAT(poses.hands(0).positions(), SizeIs(78));
  ASSERT_THAT(poses.hands(0).radii(), SizeIs(26));
  EXPECT_EQ(poses.hands(0).positions(4), 5);  // y of the wrist
  EXPECT_EQ(poses.hands(0).radii(25), 103);
  // WebXR hands have no palm. The other hand stays.
  EXPECT_EQ(cs_set_hand(joined.client.get(), CS_HAND_LEFT, joints.data(), CS_HAND_JOINTS - 1, 6), 1);
  const v1::ColliderPoses both = joined.sent().collider_poses();
  ASSERT_THAT(both.hands(), SizeIs(2));
  EXPECT_EQ(both.hands(0).side(), v1::HAND_SIDE_LEFT);
  EXPECT_THAT(both.hands(0).radii(), SizeIs(25));
  // A server accepts 60 colliders; these two hands use 40.
  const std::vector<cs_own_collider> spheres(CS_MAX_COLLIDERS, sphereAt(0.5f, 0.5f, 0.5f, 0.5f));
  cs_set_colliders(joined.client.get(), spheres.data(), CS_MAX_COLLIDERS, 6);
  EXPECT_THAT(joined.sent().collider_poses().colliders(), SizeIs(20));
  EXPECT_EQ(cs_set_hand(joined.client.get(), CS_HAND_RIGHT, nullptr, 0, 7), 1);
  const v1::ColliderPoses one = joined.sent().collider_poses();
  EXPECT_THAT(one.hands(), SizeIs(1));
  EXPECT_THAT(one.colliders(), SizeIs(CS_MAX_COLLIDERS));
  EXPECT_EQ(cs_set_hand(joined.client.get(), 3, joints.data(), CS_HAND_JOINTS, 8), 0);
  EXPECT_EQ(cs_set_hand(joined.client.get(), CS_HAND_LEFT, joints.data(), 20, 8), 0);
}

TEST(Colliders, TheHeadHasItsOwnIdAndStaysWhenOthersChange) {
  JoinedClient joined;
  const float position[] = {1, 2, 3}, orientation[] = {0, 0.6f, 0, 0.8f};
  cs_set_head(joined.client.get(), position, orientation, 0.11f, 5);
  const v1::ColliderPoses alone = joined.sent().collider_poses();
  ASSERT_THAT(alone.colliders(), SizeIs(1));
  EXPECT_EQ(alone.colliders(0).id(), CS_HEAD_ID);
  EXPECT_EQ(alone.colliders(0).sphere().radius(), 0.11f);
  EXPECT_EQ(alone.colliders(0).pose().position().y(), 2);
  EXPECT_EQ(alone.colliders(0).pose().orientation().w(), 0.8f);
  // A server accepts 60 colliders; these two hands and the head use 41.
  const std::vector<cs_own_collider> spheres(CS_MAX_COLLIDERS, sphereAt(0.5f, 0.5f, 0.5f, 0.5f));
  const std::vector<float> joints(std::size_t{4} * CS_HAND_JOINTS);
  cs_set_hand(joined.client.get(), CS_HAND_LEFT, joints.data(), CS_HAND_JOINTS, 6);
  cs_set_hand(joined.client.get(), CS_HAND_RIGHT, joints.data(), CS_HAND_JOINTS, 6);
  cs_set_colliders(joined.client.get(), spheres.data(), CS_MAX_COLLIDERS, 6);
  const v1::ColliderPoses full = joined.sent().collider_poses();
  ASSERT_THAT(full.colliders(), SizeIs(20));
  EXPECT_EQ(full.colliders(18).id(), 18u);
  EXPECT_EQ(full.colliders(19).id(), CS_HEAD_ID);
  cs_set_head(joined.client.get(), nullptr, nullptr, 0, 7);
  cs_set_colliders(joined.client.get(), nullptr, 0, 7);
  EXPECT_THAT(joined.sent().collider_poses().colliders(), SizeIs(0));
}

TEST(Colliders, AreSentWithShapeAndOrientation) {
  JoinedClient joined;
  const cs_own_collider own[] = {{.shape = CS_SHAPE_CAPSULE,
                                  .position = {1, 2, 3},
                                  .orientation = {0, 0.6f, 0, 0.8f},
                                  .radius = 0.01f,
                                  .length = 0.03f,
                                  .size = {},
                                  .top_radius = 0.008f},
                                 {.shape = CS_SHAPE_BOX,
                                  .position = {},
                                  .orientation = {},
                                  .radius = 0,
                                  .length = 0,
                                  .size = {0.1f, 0.2f, 0.3f},
                                  .top_radius = 0}};
  EXPECT_EQ(cs_set_colliders(joined.client.get(), own, 2, 5), 1);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.colliders(), SizeIs(2));
  EXPECT_EQ(poses.colliders(0).capsule().radius(), 0.01f);
  EXPECT_EQ(poses.colliders(0).capsule().length(), 0.03f);
  EXPECT_EQ(poses.colliders(0).capsule().top_radius(), 0.008f);
  EXPECT_EQ(poses.colliders(0).pose().orientation().w(), 0.8f);
  EXPECT_EQ(poses.colliders(1).box().size().z(), 0.3f);
  EXPECT_FALSE(poses.colliders(1).pose().has_orientation());
}

TEST(Colliders, OnlyTheNewestAreSentAndZeroRemovesAll) {
  JoinedClient joined;
  const cs_own_collider sphere = sphereAt(1, 2, 3, 0.1f);
  cs_set_colliders(joined.client.get(), &sphere, 1, 1);
  cs_set_colliders(joined.client.get(), nullptr, 0, 2);
  const v1::ClientMessage message = joined.sent();
  ASSERT_TRUE(message.has_collider_poses());
  EXPECT_EQ(message.collider_poses().client_time_us(), 2u);
  EXPECT_THAT(message.collider_poses().colliders(), SizeIs(0));
}

TEST(Grabs, AreSentWithCollidersAndOmitDefaults) {
  JoinedClient joined;
  const cs_own_collider sphere = sphereAt(1, 2, 3, 0.1f);
  cs_set_colliders(joined.client.get(), &sphere, 1, 1);
  cs_grab grab{.id = 7,
               .position = {1, 2, 3},
               .orientation = {},
               .radius = kNan,
               .reach = 0.5f,
               .max_force = kNan,
               .slip_distance = kNan,
               .place = nullptr};
  cs_set_grabs(joined.client.get(), &grab, 1, 2);
  const v1::ColliderPoses both = joined.sent().collider_poses();
  EXPECT_THAT(both.colliders(), SizeIs(1));
  ASSERT_THAT(both.grabs(), SizeIs(1));
  EXPECT_EQ(both.grabs(0).id(), 7u);
  EXPECT_EQ(both.grabs(0).pose().position().z(), 3);
  EXPECT_FALSE(both.grabs(0).pose().has_orientation());
  EXPECT_FALSE(both.grabs(0).has_radius());
  EXPECT_EQ(both.grabs(0).reach(), 0.5f);
  EXPECT_FALSE(both.grabs(0).has_max_force());
  EXPECT_FALSE(both.grabs(0).has_slip_distance());
  EXPECT_FALSE(both.grabs(0).has_place());
  // A change of colliders does not release the grab.
  cs_set_colliders(joined.client.get(), &sphere, 1, 3);
  EXPECT_THAT(joined.sent().collider_poses().grabs(), SizeIs(1));
  cs_set_grabs(joined.client.get(), nullptr, 0, 4);
  EXPECT_THAT(joined.sent().collider_poses().grabs(), SizeIs(0));
}

TEST(Grabs, EventsAreReported) {
  JoinedClient joined;
  v1::ServerMessage message;
  message.mutable_tick_events()->set_tick(9);
  v1::GrabEvent& event = *message.mutable_tick_events()->add_grabs();
  event.set_participant_id(5);
  event.set_grab_id(2);
  event.set_kind(v1::GRAB_EVENT_KIND_SLIPPED);
  event.set_vertices(11);
  event.set_distance(0.25f);
  event.set_ticks_since_seen(12);
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_GRABS));
  ASSERT_EQ(cs_grab_event_count(joined.client.get()), 1u);
  cs_grab_event received;
  ASSERT_EQ(cs_get_grab_event(joined.client.get(), 0, &received), 1);
  EXPECT_EQ(received.participant_id, 5u);
  EXPECT_EQ(received.grab_id, 2u);
  EXPECT_EQ(received.kind, static_cast<std::uint32_t>(CS_GRAB_SLIPPED));
  EXPECT_EQ(received.vertices, 11u);
  EXPECT_EQ(received.distance, 0.25f);
  EXPECT_EQ(received.ticks_since_seen, 12u);
  EXPECT_EQ(cs_get_grab_event(joined.client.get(), 1, &received), 0);
}

TEST(Contacts, AreReportedOnRequest) {
  JoinedClient joined;
  cs_want_contacts(joined.client.get(), 1, 1);
  EXPECT_TRUE(joined.sent().collider_poses().contact_events());
  v1::ServerMessage message;
  v1::ContactEvent& event = *message.mutable_tick_events()->add_contacts();
  event.set_kind(v1::CONTACT_EVENT_KIND_ENDED);
  event.set_participant_id(5);
  event.set_collider_id(2);
  event.set_cloth("sheet");
  event.set_impulse(0.25f);
  event.set_seconds(1.5f);
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()),
            static_cast<std::uint32_t>(CS_EVENT_CONTACTS));
  ASSERT_EQ(cs_contact_event_count(joined.client.get()), 1u);
  cs_contact_event received;
  ASSERT_EQ(cs_get_contact_event(joined.client.get(), 0, &received), 1);
  EXPECT_EQ(received.kind, static_cast<std::uint32_t>(CS_CONTACT_ENDED));
  EXPECT_EQ(received.participant_id, 5u);
  EXPECT_EQ(received.collider_id, 2u);
  EXPECT_STREQ(received.collider, "");
  EXPECT_STREQ(received.cloth, "sheet");
  EXPECT_EQ(received.impulse, 0.25f);
  EXPECT_EQ(received.seconds, 1.5f);
  EXPECT_EQ(cs_get_contact_event(joined.client.get(), 1, &received), 0);
  event.set_impulse(kNan);
  joined.client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
}

TEST(AttachmentPoses, AreSentOnceWithTheirLastValue) {
  JoinedClient joined;
  const float first[] = {1, 0, 0}, second[] = {2, 0, 0}, turned[] = {0, 0, 0, 1};
  cs_move_attachment(joined.client.get(), "rod", first, nullptr, 1, 1);
  cs_move_attachment(joined.client.get(), "knot", first, nullptr, 0, 1);
  cs_move_attachment(joined.client.get(), "rod", second, turned, 0, 1);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.attachments(), SizeIs(2));
  EXPECT_EQ(poses.attachments(0).name(), "rod");
  EXPECT_EQ(poses.attachments(0).pose().position().x(), 2);
  EXPECT_EQ(poses.attachments(0).pose().orientation().w(), 1);
  EXPECT_TRUE(poses.attachments(0).jumps());
  EXPECT_EQ(poses.attachments(1).name(), "knot");
  EXPECT_FALSE(poses.attachments(1).jumps());
  cs_set_colliders(joined.client.get(), nullptr, 0, 2);
  EXPECT_THAT(joined.sent().collider_poses().attachments(), SizeIs(0));
}

TEST(Winds, AFanAndAVortexAreSent) {
  JoinedClient joined;
  cs_own_wind winds[2]{};
  winds[0].position[1] = 2;
  winds[0].orientation[0] = 1;
  winds[0].speed = 8;
  winds[0].radius = 0.25f;
  winds[0].spread = kNan;
  winds[0].reach = 3;
  winds[1] = winds[0];
  winds[1].kind = CS_WIND_VORTEX;
  ASSERT_EQ(cs_set_winds(joined.client.get(), winds, 2, 1), 1);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.winds(), SizeIs(2));
  const v1::LocalWind &fan = poses.winds(0).wind(), &vortex = poses.winds(1).wind();
  EXPECT_EQ(fan.pose().position().y(), 2);
  EXPECT_EQ(fan.pose().orientation().x(), 1);
  EXPECT_EQ(fan.speed(), 8);
  EXPECT_EQ(fan.fan().radius(), 0.25f);
  EXPECT_FALSE(fan.fan().has_spread());
  EXPECT_EQ(fan.fan().range(), 3);
  EXPECT_EQ(poses.winds(1).id(), 1u);
  EXPECT_EQ(vortex.vortex().reach(), 3);
  winds[1].kind = 2;
  EXPECT_EQ(cs_set_winds(joined.client.get(), winds, 2, 2), 0) << "unknown kind";
  ASSERT_EQ(cs_set_winds(joined.client.get(), nullptr, 0, 3), 1);
  EXPECT_THAT(joined.sent().collider_poses().winds(), SizeIs(0));
}

TEST(Colliders, DropsCollidersBeyondTheLimit) {
  JoinedClient joined;
  const std::vector<cs_own_collider> spheres(50, sphereAt(1, 1, 1, 1));
  cs_set_colliders(joined.client.get(), spheres.data(), 50, 1);
  EXPECT_THAT(joined.sent().collider_poses().colliders(), SizeIs(CS_MAX_COLLIDERS));
}

TEST(Colliders, RefuseUnknownVersions) {
  JoinedClient joined;
  std::array spheres{sphereAt(1, 2, 3, 0.1f), sphereAt(4, 5, 6, 0.2f)};
  spheres[1].version = CS_OWN_COLLIDER_VERSION + 1;
  EXPECT_EQ(cs_set_colliders(joined.client.get(), spheres.data(), 2, 1), 0);
  EXPECT_THAT(joined.client.outgoing(), SizeIs(0));
}

TEST(Grabs, RefuseUnknownVersions) {
  JoinedClient joined;
  cs_cloth_point place{};
  cs_grab grab{};
  grab.place = &place;
  place.version = CS_CLOTH_POINT_VERSION + 1;
  EXPECT_EQ(cs_set_grabs(joined.client.get(), &grab, 1, 1), 0);
  grab = {};
  grab.version = CS_GRAB_VERSION + 1;
  EXPECT_EQ(cs_set_grabs(joined.client.get(), &grab, 1, 1), 0);
  EXPECT_THAT(joined.client.outgoing(), SizeIs(0));
}

TEST(Outgoing, FailsWhenTheTransportStopsSending) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  for (std::size_t i = 0; i <= Outbox::kMaxControl; ++i) cs_list_scenes(client.get());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("sends no messages"));
  std::size_t bytes = 1;
  EXPECT_EQ(cs_next_outgoing(client.get(), &bytes), nullptr);
  EXPECT_EQ(bytes, 0u);
}

}  // namespace
}  // namespace clothstream::client
