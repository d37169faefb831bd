// SPDX-License-Identifier: MIT
#include <array>
#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/xr/stage/fabrics.h"
#include "clients/xr/stage/solids.h"
#include "tests/xr/sample_stage.h"

namespace clothstream::xr {
namespace {

using testing::ElementsAre;

// Normal of a node as gather_normals.comp computes it.
Eigen::Vector3f normalOf(const Stage& stage, std::uint32_t node) {
  const auto at = [&](std::uint32_t n) { return Eigen::Map<const Eigen::Vector3f>(&stage.positions[3 * n]); };
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (std::uint32_t i = stage.fanStarts[node]; i < stage.fanStarts[node + 1]; ++i) {
    const Stage::Face& face = stage.fans[i];
    sum += (at(face.c) - at(node)).cross(at(face.b) - at(face.a));
  }
  return sum.normalized();
}

TEST(Topology, GridHasNormalsToItsFront) {
  Stage stage = tests::sampleStage(5);
  EXPECT_EQ(stage.fans.size(), 4U * 16);
  for (std::uint32_t node = 0; node < stage.nodeCount; ++node)
    EXPECT_LT((normalOf(stage, node) - Eigen::Vector3f::UnitZ()).norm(), 1e-5f) << node;
}

TEST(Topology, GridHasTextureCoordinatesInMetres) {
  const Stage stage = tests::sampleStage(5);
  EXPECT_NEAR(stage.vertices[4].u, 1, 1e-5f);
  EXPECT_NEAR(stage.vertices[24].v, -1, 1e-5f);
  EXPECT_EQ(stage.vertices.size(), 25U);
}

// Two triangles that share an edge, with another texture coordinate on each side of it, of a sheet of 0.2 m.
TEST(Topology, VerticesAtSeamsShareTheirNode) {
  const std::vector<float> positions{0, 0, 0, 0.2f, 0, 0, 0.2f, 0.2f, 0, 0, 0.2f, 0};
  const std::vector<std::uint32_t> corners{0, 1, 2, 0, 2, 3};
  const std::vector<float> uvs{0, 0, 1, 0, 1, 1, 5, 0, 6, 1, 5, 1};
  const std::vector<std::uint32_t> uvIndices{0, 1, 2, 3, 4, 5};
  Stage stage;
  EXPECT_TRUE(append({.firstNode = 0,
                      .nodeCount = 4,
                      .positions = positions,
                      .corners = corners,
                      .uvs = uvs,
                      .uvIndices = uvIndices},
                     stage));
  ASSERT_EQ(stage.vertices.size(), 6U);
  EXPECT_THAT(stage.indices, ElementsAre(0, 1, 2, 4, 5, 3));
  EXPECT_EQ(stage.vertices[4].node, 0U);
  EXPECT_EQ(stage.vertices[5].node, 2U);
  // A metre of cloth is a metre of texture.
  EXPECT_NEAR(stage.vertices[1].u, 0.2f, 1e-5f);
  EXPECT_NEAR(stage.vertices[4].u, 1.0f, 1e-5f);
  // Faces on both sides of the seam make the normal.
  EXPECT_EQ(stage.fanStarts[1] - stage.fanStarts[0], 2U);
}

TEST(Topology, ShapesFollowEachOther) {
  Stage stage = tests::sampleStage(3);
  const std::size_t faces = stage.fans.size();
  const std::vector<float> positions{0, 0, 0, 1, 0, 0, 0, 1, 0};
  stage.positions.insert(stage.positions.end(), positions.begin(), positions.end());
  const std::vector<std::uint32_t> corners{9, 10, 11};
  EXPECT_FALSE(append({.firstNode = 9,
                       .nodeCount = 3,
                       .positions = positions,
                       .corners = corners,
                       .uvs = {},
                       .uvIndices = {}},
                      stage));
  EXPECT_EQ(stage.nodeCount, 12U);
  EXPECT_EQ(stage.fanStarts.size(), 13U);
  EXPECT_EQ(stage.fans.size(), faces + 3);
  EXPECT_LT((normalOf(stage, 10) - Eigen::Vector3f::UnitZ()).norm(), 1e-5f);
}

TEST(Fabrics, UnknownMaterialsLookLikeCotton) {
  EXPECT_EQ(surfaceOf("of a newer server", 1).weave, surfaceOf("cotton", 1).weave);
  EXPECT_NE(surfaceOf("denim", 1).weave, surfaceOf("cotton", 1).weave);
  EXPECT_EQ(surfaceOf("denim", 1).colour, surfaceOf("denim", 2).colour);
  EXPECT_NE(surfaceOf("silk", 1).colour, surfaceOf("silk", 2).colour);
}

TEST(Solids, HeadWithKnownOrientationHasAVisor) {
  cs_collider head{};
  head.shape = CS_SHAPE_SPHERE;
  head.name = "2147483712";  // CS_HEAD_ID
  head.participant_id = 7;
  head.radius = 0.11f;
  const std::array<float, 4> turned{0, 0.7071068f, 0, 0.7071068f};  // looks along -X
  std::ranges::copy(turned, head.orientation);
  ASSERT_TRUE(isHead(head));
  std::vector<Solid> solids;
  addParticipantCollider(head, colourOf(7), 1, solids);
  ASSERT_EQ(solids.size(), 2U);
  EXPECT_LT(solids[1].pose.position.x(), -0.03f);
  head.orientation[1] = 0;
  head.orientation[3] = 1;
  solids.clear();
  addParticipantCollider(head, colourOf(7), 1, solids);
  EXPECT_EQ(solids.size(), 1U);
}

TEST(Solids, YieldingCollidersAreRed) {
  cs_collider ball{};
  ball.shape = CS_SHAPE_SPHERE;
  ball.name = "1";
  ball.participant_id = 7;
  ball.radius = 0.05f;
  ball.orientation[3] = 1;
  ball.yields = 1;
  std::vector<Solid> solids;
  addParticipantCollider(ball, colourOf(7), 1, solids);
  EXPECT_GT(solids[0].colour.x(), 4 * solids[0].colour.y());
}

TEST(Solids, RodsReachFromEndToEnd) {
  std::vector<Solid> solids;
  const Eigen::Vector3f from(0.1f, 0.2f, 0.3f), to(-0.3f, 0.5f, 0.1f);
  addRod(from, to, 0.02f, 0.01f, Solid(), solids);
  const Solid& rod = solids.at(0);
  EXPECT_LT((rod.pose.apply({0, -rod.length / 2, 0}) - from).norm(), 1e-5f);
  EXPECT_LT((rod.pose.apply({0, rod.length / 2, 0}) - to).norm(), 1e-5f);
}

}  // namespace
}  // namespace clothstream::xr
