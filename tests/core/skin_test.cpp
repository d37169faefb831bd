// SPDX-License-Identifier: MIT
// Colliders that are meshes with joints: vertices at the shown time, and joints that this client moves.
#include "clients/core/wire/skin.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "tests/core/play_out_viewer.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::SizeIs;

template <typename Number>
std::string bytesOf(const std::vector<Number>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number)};
}

const std::vector<float> kStill{0, 0, 0, 0, 0, 0, 1};

// Poses of two joints: the first at the origin, and the second 1 m above it, turned by an angle about Z.
std::vector<float> bent(double radians) {
  std::vector<float> poses = kStill;
  for (const double number : {0.0, 1.0, 0.0, 0.0, 0.0, std::sin(radians / 2), std::cos(radians / 2)})
    poses.push_back(static_cast<float>(number));
  return poses;
}

// A tetrahedron. The second joint moves vertex 1 alone, and vertex 2 to a quarter; the rest stays.
v1::ColliderState tetrahedron() {
  v1::ColliderState collider;
  collider.set_name("body");
  v1::ColliderMeshDescription& mesh = *collider.mutable_mesh();
  mesh.set_positions(bytesOf<float>({0, 0, 0, 0, 2, 0, 1, 1, 0, 0, 0, 1}));
  mesh.set_triangles(bytesOf<std::uint32_t>({0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}));
  mesh.set_joints(bytesOf<std::uint8_t>({0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0}));
  mesh.set_weights(bytesOf<float>({1, 0, 0, 0, 1, 0, 0, 0, 0.25f, 0.75f, 0, 0, 1, 0, 0, 0}));
  const std::vector<float> rest = bent(0);
  mesh.mutable_rest()->Assign(rest.begin(), rest.end());
  return collider;
}

// A scene with the tetrahedron after the colliders of ScriptedServer.
class Skins : public ::testing::Test {
 protected:
  Skins() {
    viewer_.learnClock();
    v1::StreamDescription description = viewer_.server.description();
    description.clear_colliders();
    *description.add_colliders() = tetrahedron();
    viewer_.client.receiveAll(chunksOf(description.SerializeAsString(), 100'000, 2));
  }

  void receive(std::uint64_t tick, const std::vector<float>& joints) {
    v1::Frame frame = viewer_.server.frameMessage(tick, codec::PacketKind::predicted);
    frame.clear_colliders();
    v1::ColliderState& body = *frame.add_colliders();
    body.set_name("body");
    body.mutable_joints()->Assign(joints.begin(), joints.end());
    frame.set_tick_time_us(tick * kFrameUs + kServerAhead);
    viewer_.client.receive(ScriptedServer::serialise(frame), tick * kFrameUs);
  }

  // Expects the vertices if the second joint is turned by this angle, in radians.
  void expectBent(double radians) {
    std::uint32_t vertices = 0, indices = 0;
    const std::uint32_t* triangles = nullptr;
    const float* corners = cs_get_hull(viewer_.client.get(), 0, &vertices, &triangles, &indices);
    ASSERT_EQ(vertices, 4u);
    ASSERT_EQ(indices, 12u);
    const double sine = std::sin(radians), cosine = std::cos(radians);
    const double expected[] = {0, 0, 0, -sine, 1 + cosine, 0, 0.75 + 0.25 * cosine, 1 + 0.25 * sine,
                               0, 0, 0, 1};
    for (std::size_t i = 0; i < 12; ++i) EXPECT_NEAR(corners[i], expected[i], 1e-6) << "number " << i;
  }

  Viewer viewer_{chosenDelay(50)};
};

TEST_F(Skins, VerticesFollowTheJointsOfTheNewestFrameWithoutPlayOut) {
  expectBent(0);
  ASSERT_EQ(cs_set_play_out(viewer_.client.get(), nullptr), 1);
  receive(1, bent(0.5));
  expectBent(0.5);
  receive(2, bent(-0.25));
  expectBent(-0.25);
}

TEST_F(Skins, VerticesHaveTheTimeOfTheClothThatIsShown) {
  for (std::uint64_t tick = 1; tick <= 4; ++tick) receive(tick, bent(0.1 * static_cast<double>(tick)));
  viewer_.play(2 * kFrameUs + 50 * kMs);
  expectBent(0.2);
  viewer_.play(2 * kFrameUs + 55 * kMs);
  expectBent(0.25);
  viewer_.play(4 * kFrameUs + 50 * kMs);
  expectBent(0.4);
}

TEST_F(Skins, VerticesRestWhileAFrameHasNoJointsOrTooMany) {
  ASSERT_EQ(cs_set_play_out(viewer_.client.get(), nullptr), 1);
  receive(1, bent(0.5));
  receive(2, {});
  expectBent(0);
  std::vector<float> three = bent(0.5);
  three.insert(three.end(), kStill.begin(), kStill.end());
  receive(3, three);
  expectBent(0);
}

TEST_F(Skins, RefusesASkinThatDoesNotFitItsMesh) {
  const auto refuses = [](auto change) {
    ClientUnderTest client;
    const ScriptedServer server;
    v1::StreamDescription description = server.description();
    *description.add_colliders() = tetrahedron();
    change(*description.mutable_colliders()->rbegin()->mutable_mesh());
    client.receive(server.welcome());
    client.receiveAll(chunksOf(description.SerializeAsString(), 100'000, 1));
    return cs_get_state(client.get()) == CS_STATE_FAILED;
  };
  using M = v1::ColliderMeshDescription;
  EXPECT_FALSE(refuses([](M&) {}));
  EXPECT_TRUE(refuses([](M& mesh) { (*mesh.mutable_joints())[5] = 2; })) << "a joint that is not there";
  EXPECT_TRUE(refuses([](M& mesh) { mesh.mutable_joints()->pop_back(); }));
  EXPECT_TRUE(refuses([](M& mesh) { mesh.mutable_joints()->append(4, '\0'); })) << "more than vertices";
  EXPECT_TRUE(refuses([](M& mesh) { mesh.mutable_weights()->resize(16); }));
  EXPECT_TRUE(refuses([](M& mesh) {
    const std::vector<float> nan(16, std::numeric_limits<float>::quiet_NaN());
    mesh.set_weights(bytesOf(nan));
  }));
  EXPECT_TRUE(refuses([](M& mesh) { mesh.add_rest(0); })) << "a part of a joint";
  EXPECT_TRUE(refuses([](M& mesh) { mesh.mutable_rest()->Resize(7 * 129, 0); })) << "too many joints";
  EXPECT_TRUE(refuses([](M& mesh) { mesh.set_rest(3, std::numeric_limits<float>::infinity()); }));
}

TEST(Joints, AreSentOnceWithTheirLastPoses) {
  JoinedClient joined;
  const std::vector<float> first = bent(0.1), last = bent(0.2);
  cs_move_joints(joined.client.get(), "body", first.data(), 2, 1, 1);
  cs_move_joints(joined.client.get(), "tail", kStill.data(), 1, 0, 1);
  cs_move_joints(joined.client.get(), "body", last.data(), 2, 0, 1);
  const v1::ColliderPoses poses = joined.sent().collider_poses();
  ASSERT_THAT(poses.joints(), SizeIs(2));
  EXPECT_EQ(poses.joints(0).collider(), "body");
  ASSERT_THAT(poses.joints(0).joints(), SizeIs(2));
  EXPECT_EQ(poses.joints(0).joints(1).position().y(), 1);
  EXPECT_EQ(poses.joints(0).joints(1).orientation().z(), last[12]);
  EXPECT_EQ(poses.joints(0).joints(1).orientation().w(), last[13]);
  EXPECT_TRUE(poses.joints(0).jumps());  // the first ones should jump
  EXPECT_EQ(poses.joints(1).collider(), "tail");
  EXPECT_FALSE(poses.joints(1).jumps());
  cs_set_colliders(joined.client.get(), nullptr, 0, 2);
  EXPECT_THAT(joined.sent().collider_poses().joints(), SizeIs(0));
}

TEST(Joints, BeyondTheLimitAreNotSent) {
  JoinedClient joined;
  const std::vector<float> poses(kJointNumbers * (kMaxJoints + 5), 0.5f);
  cs_move_joints(joined.client.get(), "body", poses.data(), kMaxJoints + 5, 0, 1);
  EXPECT_THAT(joined.sent().collider_poses().joints(0).joints(), SizeIs(kMaxJoints));
}

}  // namespace
}  // namespace clothstream::client
