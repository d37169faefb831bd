// SPDX-License-Identifier: MIT
// C interface of bodies: taking one, moving it by what a headset knows, losing it.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "tests/core/body_figure.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::SizeIs;
using ::testing::StrEq;

template <typename Number>
std::string littleEndianOf(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

// Adds a figure at (1, 0, 2).
void addFigure(v1::StreamDescription& description, const std::string& name, const Hull& figure) {
  v1::ColliderState& body = *description.add_colliders();
  body.set_name(name);
  body.mutable_position()->set_x(1);
  body.mutable_position()->set_z(2);
  v1::ColliderMeshDescription& mesh = *body.mutable_mesh();
  mesh.set_positions(littleEndianOf(figure.vertices));
  mesh.set_triangles(littleEndianOf(figure.triangles));
  mesh.set_joints(littleEndianOf(figure.skin.joints));
  mesh.set_weights(littleEndianOf(figure.skin.weights));
  mesh.mutable_rest()->Assign(figure.skin.rest.begin(), figure.skin.rest.end());
  mesh.mutable_joint_names()->Assign(figure.skin.names.begin(), figure.skin.names.end());
  mesh.mutable_joint_parents()->Assign(figure.skin.parents.begin(), figure.skin.parents.end());
}

// A scene whose colliders are the figures "avatar" and "giant", and a ball.
class Wearing : public ::testing::Test {
 protected:
  Wearing() {
    client_.receive(welcome());
    describe(tests::figure());
    client_.outgoing();
  }

  // Welcome of a server at which this participant wears a body; without one, it does not know the
  // participant.
  std::string welcome(const std::string& body = {}) const {
    v1::ServerMessage message;
    message.ParseFromString(server_.welcome());
    v1::Welcome& welcome = *message.mutable_welcome();
    welcome.set_resume_token("0123456789abcdef");
    welcome.set_hold_ms(60'000);
    welcome.set_resumed(!body.empty());
    v1::Participant& own = *welcome.add_participants();
    own.set_id(42);
    own.set_role(v1::ROLE_PARTICIPANT);
    own.set_body(body);
    return message.SerializeAsString();
  }

  void describe(const Hull& figure) {
    v1::StreamDescription description = server_.description();
    description.clear_colliders();
    addFigure(description, "avatar", figure);
    v1::ColliderState& ball = *description.add_colliders();
    ball.set_name("ball");
    ball.mutable_sphere()->set_radius(0.1f);
    addFigure(description, "giant", figure);
    client_.receiveAll(chunksOf(description.SerializeAsString(), 100'000, 1));
  }
  cs_client* client() const { return client_.get(); }
  // The only message that waits to be sent.
  v1::ClientMessage sent() {
    const std::vector<v1::ClientMessage> all = client_.outgoing();
    EXPECT_THAT(all, SizeIs(1));
    return all.empty() ? v1::ClientMessage() : all.front();
  }
  void announce(const std::string& body) {
    v1::ServerMessage message;
    v1::Presence& presence = *message.mutable_presence();
    presence.set_kind(v1::PRESENCE_KIND_BODY_CHANGED);
    presence.mutable_participant()->set_id(42);
    presence.mutable_participant()->set_role(v1::ROLE_PARTICIPANT);
    presence.mutable_participant()->set_body(body);
    client_.receive(message.SerializeAsString());
  }
  static cs_tracked_body standing() {
    cs_tracked_body tracked{};
    tracked.version = CS_TRACKED_BODY_VERSION;
    tracked.parts = CS_BODY_HEAD;
    tracked.head[1] = 1.6f;
    tracked.head[6] = 1;
    return tracked;
  }

  ScriptedServer server_;
  ClientUnderTest client_;
};

TEST_F(Wearing, TakesABodyWhereItIsAndGivesItBack) {
  EXPECT_EQ(cs_is_body(client(), 0), 1);
  EXPECT_EQ(cs_is_body(client(), 1), 0);
  EXPECT_EQ(cs_is_body(client(), 3), 0);
  EXPECT_EQ(cs_wear(client(), "ball"), 0);
  EXPECT_EQ(cs_wear(client(), "stranger"), 0);
  EXPECT_THAT(client_.outgoing(), SizeIs(0));
  EXPECT_EQ(cs_wear(client(), "avatar"), 1);
  const v1::ClientMessage taken = sent();
  EXPECT_NE(taken.request_id(), 0u);
  EXPECT_EQ(taken.wear_body().collider(), "avatar");
  EXPECT_EQ(taken.wear_body().stands().position().x(), 1);
  EXPECT_EQ(taken.wear_body().stands().position().z(), 2);
  announce("avatar");
  EXPECT_THAT(cs_body_of(client(), 42), StrEq("avatar"));
  EXPECT_THAT(cs_body_of(client(), 7), StrEq(""));
  EXPECT_EQ(cs_wear(client(), nullptr), 1);
  const v1::ClientMessage given = sent();
  EXPECT_TRUE(given.has_wear_body());
  EXPECT_EQ(given.wear_body().collider(), "");
  EXPECT_FALSE(given.wear_body().has_stands());
  announce("");
  EXPECT_EQ(cs_wear(client(), ""), 1);
  EXPECT_THAT(client_.outgoing(), SizeIs(0)) << "nothing to give back";
  announce("avatar");
  EXPECT_EQ(cs_wear(client(), ""), 1);
  EXPECT_EQ(sent().wear_body().collider(), "") << "the body of an earlier client of this participant";
}

TEST_F(Wearing, SendsTheJointsOfTheBody) {
  cs_tracked_body tracked = standing();
  EXPECT_EQ(cs_set_body(client(), &tracked, 0), 0) << "no body yet";
  cs_wear(client(), "avatar");
  sent();
  std::uint32_t count = 1;
  EXPECT_EQ(cs_body_joints(client(), &count), nullptr);
  EXPECT_EQ(count, 0u);
  ASSERT_EQ(cs_set_body(client(), &tracked, 1000), 1);
  const v1::ColliderPoses first = sent().collider_poses();
  ASSERT_THAT(first.joints(), SizeIs(1));
  EXPECT_EQ(first.joints(0).collider(), "avatar");
  EXPECT_THAT(first.joints(0).joints(), SizeIs(17));
  EXPECT_TRUE(first.joints(0).jumps());
  const float* numbers = cs_body_joints(client(), &count);
  ASSERT_EQ(count, 17u);
  EXPECT_EQ(numbers[0], first.joints(0).joints(0).position().x());
  // The person stands at the origin, and the collider does not.
  EXPECT_NEAR(numbers[0], -1, 0.01);
  EXPECT_NEAR(numbers[2], -2, 0.15);
  tracked.parts = CS_BODY_HEAD | CS_BODY_RIGHT_HAND;
  const float hand[] = {0.2f, 1.2f, -0.3f, 0, 0, 0, 1};
  std::copy(hand, hand + 7, tracked.right_hand);
  std::uint64_t nowUs = 1000;
  for (int i = 0; i < 40; ++i) ASSERT_EQ(cs_set_body(client(), &tracked, nowUs += 11'000), 1);
  EXPECT_FALSE(sent().collider_poses().joints(0).jumps());
  float wrist[7];
  ASSERT_EQ(cs_get_body_part(client(), CS_BODY_RIGHT_HAND, wrist), 1);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(wrist[axis], hand[axis], 0.002);
  for (int number = 3; number < 7; ++number) EXPECT_NEAR(wrist[number], hand[number], 1e-5);
  EXPECT_EQ(cs_get_body_part(client(), 3, wrist), 0);
}

TEST_F(Wearing, RefusesWhatIsNotTracked) {
  cs_wear(client(), "avatar");
  sent();
  const auto refuses = [&](auto change) {
    cs_tracked_body tracked = standing();
    change(tracked);
    return cs_set_body(client(), &tracked, 0) == 0;
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(refuses([](cs_tracked_body& t) { t.version = 2; }));
  EXPECT_TRUE(refuses([](cs_tracked_body& t) { t.parts = CS_BODY_LEFT_HAND; }));
  EXPECT_TRUE(refuses([](cs_tracked_body& t) { t.head[2] = kNan; }));
  EXPECT_TRUE(refuses([](cs_tracked_body& t) { t.floor = kNan; }));
  EXPECT_TRUE(refuses([](cs_tracked_body& t) {
    t.parts |= CS_BODY_LEFT_ANKLE;
    t.left_ankle[0] = std::numeric_limits<float>::infinity();
  }));
  EXPECT_THAT(client_.outgoing(), SizeIs(0));
  EXPECT_FALSE(refuses([](cs_tracked_body& t) { t.left_ankle[0] = kNan; })) << "a part that is not tracked";
}

TEST_F(Wearing, LosesABodyThatTheServerRefusesOrGivesBack) {
  cs_tracked_body tracked = standing();
  cs_wear(client(), "avatar");
  v1::ServerMessage refusal;
  refusal.set_request_id(sent().request_id());
  refusal.mutable_error()->set_code(v1::ERROR_CODE_PERMISSION_DENIED);
  refusal.mutable_error()->set_text("participant 7 wears it");
  EXPECT_EQ(client_.receive(refusal.SerializeAsString()), CS_EVENT_ERROR + 0u);
  EXPECT_EQ(cs_set_body(client(), &tracked, 0), 0);
  cs_wear(client(), "avatar");
  sent();
  announce("avatar");
  EXPECT_EQ(cs_set_body(client(), &tracked, 0), 1);
  announce("");
  EXPECT_EQ(cs_set_body(client(), &tracked, 0), 0);
}

TEST_F(Wearing, KeepsTheBodyThatItHasIfTheServerRefusesAnother) {
  cs_tracked_body tracked = standing();
  cs_wear(client(), "avatar");
  sent();
  announce("avatar");
  EXPECT_EQ(cs_wear(client(), "avatar"), 1);
  EXPECT_THAT(client_.outgoing(), SizeIs(0)) << "it has this body";
  cs_wear(client(), "giant");
  v1::ServerMessage refusal;
  refusal.set_request_id(sent().request_id());
  refusal.mutable_error()->set_code(v1::ERROR_CODE_PERMISSION_DENIED);
  // A server that has announced the body takes that back first.
  for (const char* body : {"giant", "avatar"}) announce(body);
  client_.receive(refusal.SerializeAsString());
  ASSERT_EQ(cs_set_body(client(), &tracked, 0), 1);
  EXPECT_EQ(sent().collider_poses().joints(0).collider(), "avatar");
  announce("");
  EXPECT_EQ(cs_set_body(client(), &tracked, 0), 0);
}

TEST_F(Wearing, TakesTheBodyAgainFromAServerThatHasForgottenIt) {
  cs_tracked_body tracked = standing();
  cs_wear(client(), "avatar");
  announce("avatar");
  std::uint64_t nowUs = 0;
  const auto returned = [&](const std::string& body) {
    cs_disconnected(client(), nowUs += 1000);
    EXPECT_EQ(cs_get_state(client()), CS_STATE_RECONNECTING);
    cs_connecting(client(), nowUs += 1000);
    client_.outgoing();
    client_.receive(welcome(body), nowUs += 1000);
    std::string taken;
    for (const v1::ClientMessage& sent : client_.outgoing())
      if (sent.has_wear_body()) taken += sent.wear_body().collider();
    return taken;
  };
  EXPECT_EQ(returned("avatar"), "") << "the server has kept it";
  EXPECT_EQ(returned(""), "avatar");
  describe(tests::figure());
  EXPECT_EQ(cs_set_body(client(), &tracked, 4000), 1);
  client_.outgoing();
  // The scene has a figure with another skeleton now.
  std::vector<tests::FigureJoint> joints = tests::figureJoints();
  joints.pop_back();
  describe(tests::figureOf(joints));
  EXPECT_EQ(sent().wear_body().collider(), "") << "it is given back";
  EXPECT_EQ(cs_set_body(client(), &tracked, 5000), 0);
}

TEST_F(Wearing, TellsWhatIsBelowTheNeck) {
  std::uint32_t count = 0;
  const std::uint32_t* corners = cs_body_below_neck(client(), 0, &count);
  ASSERT_NE(corners, nullptr);
  std::uint32_t vertices = 0, all = 0;
  const std::uint32_t* triangles = nullptr;
  ASSERT_NE(cs_get_hull(client(), 0, &vertices, &triangles, &all), nullptr);
  EXPECT_EQ(count, all - 3 * 4);
  EXPECT_EQ(cs_body_below_neck(client(), 1, &count), nullptr);
  EXPECT_EQ(count, 0u);
}

TEST_F(Wearing, RefusesJointsOfTheDescriptionThatDoNotFit) {
  const auto fails = [](auto change) {
    Hull figure = tests::figure();
    change(figure);
    ClientUnderTest client;
    const ScriptedServer server;
    v1::StreamDescription description = server.description();
    addFigure(description, "avatar", figure);
    client.receive(server.welcome());
    client.receiveAll(chunksOf(description.SerializeAsString(), 100'000, 1));
    return cs_get_state(client.get()) == CS_STATE_FAILED;
  };
  EXPECT_FALSE(fails([](Hull&) {}));
  EXPECT_TRUE(fails([](Hull& figure) { figure.skin.names.pop_back(); }));
  EXPECT_TRUE(fails([](Hull& figure) { figure.skin.names.resize(129); }));
  EXPECT_TRUE(fails([](Hull& figure) { figure.skin.parents.push_back(0); }));
  EXPECT_TRUE(fails([](Hull& figure) { figure.skin.parents[3] = 4; })) << "its own parent";
  EXPECT_TRUE(fails([](Hull& figure) { figure.skin.parents[3] = 400; }));
}

}  // namespace
}  // namespace clothstream::client
