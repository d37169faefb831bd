// SPDX-License-Identifier: MIT
// Colliders and parameters on their way to the server, and changes, notices and scenes on their way back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/outbox.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

struct Joined {
  Joined() { client.join(ScriptedServer()); }
  v1::ClientMessage sent() {
    const auto messages = client.outgoing();
    EXPECT_THAT(messages, SizeIs(1));
    return messages.empty() ? v1::ClientMessage() : messages[0];
  }
  ClientUnderTest client;
};

TEST(Colliders, TravelWithTheTimeTheyWereTrue) {
  Joined joined;
  const float spheres[] = {1, 2, 3, 0.1f, 4, 5, 6, 0.2f};
  cs_set_colliders(joined.client.get(), spheres, 2, 777);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  EXPECT_EQ(poses.client_time_us(), 777u);
  ASSERT_THAT(poses.colliders(), SizeIs(2));
  EXPECT_NE(poses.colliders(0).id(), poses.colliders(1).id());
  EXPECT_EQ(poses.colliders(1).pose().position().y(), 5);
  EXPECT_EQ(poses.colliders(1).sphere().radius(), 0.2f);
}

TEST(Colliders, TravelWithTheirShapeAndTurn) {
  Joined joined;
  const cs_own_collider own[] = {{.shape = CS_SHAPE_CAPSULE,
                                  .position = {1, 2, 3},
                                  .orientation = {0, 0.6f, 0, 0.8f},
                                  .radius = 0.01f,
                                  .length = 0.03f,
                                  .size = {}},
                                 {.shape = CS_SHAPE_BOX,
                                  .position = {},
                                  .orientation = {},
                                  .radius = 0,
                                  .length = 0,
                                  .size = {0.1f, 0.2f, 0.3f}}};
  cs_set_shapes(joined.client.get(), own, 2, 5);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.colliders(), SizeIs(2));
  EXPECT_EQ(poses.colliders(0).capsule().radius(), 0.01f);
  EXPECT_EQ(poses.colliders(0).capsule().length(), 0.03f);
  EXPECT_EQ(poses.colliders(0).pose().orientation().w(), 0.8f);
  EXPECT_EQ(poses.colliders(1).box().size().z(), 0.3f);
  EXPECT_FALSE(poses.colliders(1).pose().has_orientation());
}

TEST(Colliders, OnlyTheNewestTravelWhereTheTransportIsBehindAndNoneMeansNone) {
  Joined joined;
  const float sphere[] = {1, 2, 3, 0.1f};
  cs_set_colliders(joined.client.get(), sphere, 1, 1);
  cs_set_colliders(joined.client.get(), nullptr, 0, 2);
  const v1::ClientMessage message = joined.sent();
  ASSERT_TRUE(message.has_collider_poses());
  EXPECT_EQ(message.collider_poses().client_time_us(), 2u);
  EXPECT_THAT(message.collider_poses().colliders(), SizeIs(0));
}

TEST(Colliders, MoreThanAllowedAreLeftOut) {
  Joined joined;
  const std::vector<float> spheres(4 * 50, 1.0f);
  cs_set_colliders(joined.client.get(), spheres.data(), 50, 1);
  EXPECT_THAT(joined.sent().collider_poses().colliders(), SizeIs(CS_MAX_COLLIDERS));
}

TEST(Parameters, OnlyWhatIsGivenIsChanged) {
  Joined joined;
  const float wind[] = {1, 0, -2};
  cs_set_environment(joined.client.get(), nullptr, wind, nullptr);
  const v1::ClientMessage message = joined.sent();
  EXPECT_NE(message.request_id(), 0u);
  const v1::ParameterChange& change = message.parameter_change();
  EXPECT_FALSE(change.has_gravity());
  EXPECT_FALSE(change.has_air_density());
  EXPECT_EQ(change.wind().value().z(), -2);

  const float bend[] = {20, 0.1f}, damping = 0.5f;
  cs_set_cloth(joined.client.get(), "curtain", nullptr, nullptr, bend, &damping);
  const v1::ParameterChange cloth = joined.sent().parameter_change();
  ASSERT_THAT(cloth.cloths(), SizeIs(1));
  EXPECT_EQ(cloth.cloths(0).name(), "curtain");
  EXPECT_FALSE(cloth.cloths(0).has_structural());
  EXPECT_EQ(cloth.cloths(0).bend().stiffness(), 20);
  EXPECT_EQ(cloth.cloths(0).bend().damping(), 0.1f);
  EXPECT_EQ(cloth.cloths(0).damping(), 0.5f);
  EXPECT_FALSE(cloth.cloths(0).has_friction());

  const float radius = 0.3f;
  cs_set_collider(joined.client.get(), "ball", nullptr, &radius);
  const v1::ParameterChange collider = joined.sent().parameter_change();
  ASSERT_THAT(collider.colliders(), SizeIs(1));
  EXPECT_EQ(collider.colliders(0).name(), "ball");
  EXPECT_FALSE(collider.colliders(0).has_position());
  EXPECT_EQ(collider.colliders(0).radius(), 0.3f);
}

TEST(Parameters, AreThoseOfTheDescriptionUntilSomebodyChangesThem) {
  Joined joined;
  cs_environment environment;
  ASSERT_EQ(cs_get_environment(joined.client.get(), &environment), 1);
  EXPECT_EQ(environment.gravity[1], -9.81f);  // the default: the definition is silent
  EXPECT_EQ(environment.wind[0], 3);
  EXPECT_EQ(environment.air_density, 1.2f);
  cs_cloth_parameters cloth;
  ASSERT_EQ(cs_get_cloth_parameters(joined.client.get(), 0, &cloth), 1);
  EXPECT_EQ(cloth.structural[0], 100);
  EXPECT_EQ(cloth.damping, 0.25f);

  v1::ServerMessage message;
  v1::ParameterChange& change = *message.mutable_parameter_changed()->mutable_change();
  change.mutable_wind()->mutable_value()->set_z(-1);
  v1::ClothChange& everyCloth = *change.add_cloths();
  everyCloth.mutable_structural()->set_stiffness(50);
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()),
            static_cast<std::uint32_t>(CS_EVENT_PARAMETERS));
  cs_get_environment(joined.client.get(), &environment);
  EXPECT_EQ(environment.wind[0], 0);
  EXPECT_EQ(environment.wind[2], -1);
  EXPECT_EQ(environment.air_density, 1.2f);
  cs_get_cloth_parameters(joined.client.get(), 0, &cloth);
  EXPECT_EQ(cloth.structural[0], 50);
  EXPECT_EQ(cloth.damping, 0.25f);
}

TEST(Parameters, ThereAreNoneBeforeTheDescription) {
  ClientUnderTest client;
  cs_environment environment;
  cs_cloth_parameters cloth;
  EXPECT_EQ(cs_get_environment(client.get(), &environment), 0);
  EXPECT_EQ(cs_get_cloth_parameters(client.get(), 0, &cloth), 0);
  EXPECT_EQ(cs_vertex_count(client.get()), 0u);
}

TEST(Notices, AreHandedOn) {
  Joined joined;
  v1::ServerMessage message;
  message.mutable_notice()->set_text("simulated time runs slow");
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_NOTICE));
  EXPECT_STREQ(cs_notice_text(joined.client.get()), "simulated time runs slow");
}

TEST(Scenes, CanBeAskedForInsideTheStream) {
  Joined joined;
  cs_list_scenes(joined.client.get());
  EXPECT_TRUE(joined.sent().has_list_scenes());
  v1::ServerMessage message;
  message.mutable_list_scenes()->add_scenes()->set_name("curtain");
  message.mutable_list_scenes()->add_scenes()->set_name("flag");
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_SCENES));
  ASSERT_EQ(cs_scene_count(joined.client.get()), 2u);
  EXPECT_STREQ(cs_scene(joined.client.get(), 1), "flag");
  EXPECT_STREQ(cs_scene(joined.client.get(), 2), "");
}

TEST(Outgoing, ATransportThatTakesNothingEndsTheClientInsteadOfItsMemory) {
  ClientUnderTest client;
  client.join(ScriptedServer());
  for (std::size_t i = 0; i <= Outbox::kMaxControl; ++i) cs_list_scenes(client.get());
  EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  EXPECT_THAT(cs_error_text(client.get()), HasSubstr("takes no messages"));
  std::size_t bytes = 1;
  EXPECT_EQ(cs_next_outgoing(client.get(), &bytes), nullptr);
  EXPECT_EQ(bytes, 0u);
}

}  // namespace
}  // namespace clothstream::client
