// SPDX-License-Identifier: MIT
// Bodies that peers wear: where they stand, who moves them, and what is refused.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model/solids.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using tests::TestPeer;
using Body = v1::ServerMessage;

class WearingTest : public tests::ServerTest {
 protected:
  // A scene with the ball of small scenes and two rods of two joints. "giant" moves by itself.
  static model::Scene dressed() {
    model::Scene scene = tests::smallScene("dressed");
    model::ClosedMesh rod = *model::rodMesh(0.03f, 0.4f, 4, 4);
    model::Skin skin{.joints = {{"hips", std::nullopt, {}}, {"head", 0, {}}}, .vertices = {}, .keys = {}};
    for (const model::Vec3& vertex : rod.vertices)
      skin.vertices.push_back({{vertex.x() > 0 ? std::uint8_t{1} : std::uint8_t{0}, 0, 0, 0}, {1, 0, 0, 0}});
    rod.skin = skin;
    for (const char* name : {"giant", "avatar"})
      scene.colliders.push_back({.name = name, .shape = std::make_shared<const model::ClosedMesh>(rod)});
    scene.colliders[1].motion.keys = {{0, {2, 0, 0}}, {1, {2, 0, 1}}, {2, {2, 0, 0}}};
    scene.colliders[2].pose.position = {-2, 0, 0};
    return scene;
  }
  static v1::ClientMessage wearing(const std::string& body, std::optional<float> z = {}) {
    v1::ClientMessage message;
    message.mutable_wear_body()->set_collider(body);
    if (z) message.mutable_wear_body()->mutable_stands()->mutable_position()->set_z(*z);
    return message;
  }
  // Joints of a body: the second one is at this height above the first.
  static v1::ClientMessage joints(const std::string& body, float y) {
    v1::ClientMessage message;
    v1::ColliderJoints& moved = *message.mutable_collider_poses()->add_joints();
    moved.set_collider(body);
    moved.add_joints();
    moved.add_joints()->mutable_position()->set_y(y);
    moved.set_jumps(true);
    return message;
  }
  // The error that answers the message, or nullopt if the server takes it.
  static std::optional<v1::Error> answer(TestPeer& peer, v1::ClientMessage message) {
    message.set_request_id(99);
    peer.send(message);
    v1::ClientMessage ping;
    ping.set_request_id(100);
    ping.mutable_ping();
    peer.send(ping);
    const v1::ServerMessage first = peer.readUntil([](const Body& read) { return read.request_id() >= 99; });
    if (!first.has_error()) return std::nullopt;
    peer.readUntil([](const Body& read) { return read.request_id() == 100; });
    return first.error();
  }
  scene::LiveScene& live() { return *server().scenes.find("dressed"); }
  // Name of the body of the participant with this id.
  std::string bodyOf(std::uint64_t id) {
    for (const scene::SavedParticipant& saved : live().roster.saved().participants)
      if (saved.participant.id == id) return saved.participant.body;
    return "?";
  }
};

#define START_WEARING()                            \
  ASSERT_NO_FATAL_FAILURE(start({}, {dressed()})); \
  if (::testing::Test::IsSkipped()) return

TEST_F(WearingTest, StandsWhereItIsTakenAndOnlyItsWearerMovesIt) {
  START_WEARING();
  TestPeer wearer(server()), other(server());
  wearer.join("dressed");
  other.join("dressed");
  EXPECT_FALSE(answer(wearer, wearing("giant", 7)));
  const v1::Presence presence = other.readUntil(Body::kPresence).presence();
  EXPECT_EQ(presence.kind(), v1::PRESENCE_KIND_BODY_CHANGED);
  EXPECT_EQ(presence.participant().id(), wearer.welcome().participant_id());
  EXPECT_EQ(presence.participant().body(), "giant");
  const auto stateOf = [](const tests::SeenFrame& frame) { return frame.colliders.at(1); };
  do other.readFrames(1);
  while (stateOf(other.frames().back()).position().z() != 7);
  // Its motion would take it elsewhere within a frame.
  other.readFrames(5);
  EXPECT_EQ(stateOf(other.frames().back()).position().z(), 7);
  EXPECT_FALSE(answer(wearer, joints("giant", 0.5f)));
  const std::optional<v1::Error> refused = answer(other, joints("giant", 0.9f));
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code(), v1::ERROR_CODE_PERMISSION_DENIED);
  EXPECT_THAT(refused->text(), StartsWith("colliderPoses.joints[0].collider = \"giant\": participant "));
  EXPECT_FALSE(refused->fatal());
  other.readFrames(10);
  const v1::ColliderState state = stateOf(other.frames().back());
  ASSERT_EQ(state.joints_size(), 14);
  EXPECT_EQ(state.joints(8), 0.5f) << "height of the second joint";
}

TEST_F(WearingTest, ErrorsSayWhatIsWrongAndChangeNothing) {
  START_WEARING();
  TestPeer peer(server()), other(server()), viewer(server());
  peer.join("dressed");
  other.join("dressed");
  viewer.role = v1::ROLE_VIEWER;
  viewer.join("dressed");
  EXPECT_FALSE(answer(peer, wearing("avatar")));
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  struct Case {
    TestPeer& peer;
    v1::ClientMessage message;
    v1::ErrorCode code;
    const char* text;
  };
  const std::vector<Case> cases{
      {peer, wearing("stranger"), v1::ERROR_CODE_NOT_FOUND,
       "wearBody.collider = \"stranger\": must be one of ball, giant, avatar"},
      {peer, wearing("ball"), v1::ERROR_CODE_INVALID_ARGUMENT, "wearBody.collider = \"ball\": has no joints"},
      {peer, wearing("giant", kNan), v1::ERROR_CODE_INVALID_ARGUMENT, "wearBody.stands.position.z = nan"},
      {peer, wearing("giant", 1e9f), v1::ERROR_CODE_INVALID_ARGUMENT, "wearBody.stands"},
      {other, wearing("avatar", 1), v1::ERROR_CODE_PERMISSION_DENIED,
       "wearBody.collider = \"avatar\": participant "},
      {viewer, wearing("giant"), v1::ERROR_CODE_PERMISSION_DENIED,
       "wearBody: requires the role participant; yours is viewer"},
  };
  for (const Case& wrong : cases) {
    const std::optional<v1::Error> refused = answer(wrong.peer, wrong.message);
    ASSERT_TRUE(refused) << wrong.text;
    EXPECT_EQ(refused->code(), wrong.code) << refused->text();
    EXPECT_THAT(refused->text(), HasSubstr(wrong.text));
    EXPECT_FALSE(refused->fatal()) << refused->text();
  }
  EXPECT_EQ(bodyOf(peer.welcome().participant_id()), "avatar");
  EXPECT_EQ(bodyOf(other.welcome().participant_id()), "");
  EXPECT_EQ(live().definition().colliders[2].pose.position.x(), -2);
}

// The collider of a body stands by a change of parameters, which the server refuses if there were too many.
TEST_F(WearingTest, ParticipantsKeepTheirBodyIfTheNextOneDoesNotStand) {
  START_WEARING();
  TestPeer peer(server());
  peer.join("dressed");
  const std::uint64_t id = peer.welcome().participant_id();
  EXPECT_FALSE(answer(peer, wearing("avatar")));
  std::optional<v1::Error> refused;
  // The limit has room again after 17 ms, in which a busy machine may run something else.
  for (int tries = 0; tries < 4 && !refused; ++tries) {
    while (live().countChange(id, "test")) {
    }
    refused = answer(peer, wearing("giant", 1));
    if (!refused) {
      EXPECT_FALSE(answer(peer, wearing("avatar")));
    }
  }
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED) << refused->text();
  EXPECT_EQ(bodyOf(id), "avatar");
}

}  // namespace
}  // namespace clothstream::session
