// SPDX-License-Identifier: MIT
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/octahedral.h"
#include "proto/codec/vertex_normals.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

TEST(Octahedral, ReturnsAnyDirectionWithinADegree) {
  // Half a step of 1/127 on each axis of the octahedron. Its faces are up to sqrt(3) nearer than the sphere:
  // sqrt(2) * 0.5 / 127 * 3 / sqrt(3) rad = 0.55 degrees, and the same again where |u| + |v| bends.
  std::mt19937 random(1);
  std::normal_distribution<float> gauss;
  for (int i = 0; i < 100'000; ++i) {
    float n[3] = {gauss(random), gauss(random), gauss(random)};
    const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (float& component : n) component /= length;
    float decoded[3];
    decodeOctahedral(encodeOctahedral(n), decoded);
    ASSERT_LT(degreesBetween(n, decoded), 1.0) << n[0] << ' ' << n[1] << ' ' << n[2];
  }
}

TEST(Octahedral, ReturnsTheAxesExactly) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {1.0f, -1.0f}) {
      float n[3] = {0, 0, 0}, decoded[3];
      n[axis] = sign;
      decodeOctahedral(encodeOctahedral(n), decoded);
      EXPECT_LT(degreesBetween(n, decoded), 1e-6);
    }
  }
}

TEST(Octahedral, GivesAUnitVectorForAnyBytes) {
  for (int u = -128; u < 128; ++u) {
    for (int v = -128; v < 128; ++v) {
      float n[3];
      decodeOctahedral({static_cast<std::int8_t>(u), static_cast<std::int8_t>(v)}, n);
      ASSERT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1.0f, 1e-6f) << u << ' ' << v;
    }
  }
}

TEST(VertexNormals, FaceTheViewerWhenRowsRunDown) {
  const StreamLayout layout{.epoch = 1, .cloths = {{.vertexCount = 12, .rows = 3, .columns = 4}}};
  std::vector<float> positions, normals(36);
  for (int i = 0; i < 12; ++i) {
    positions.insert(positions.end(), {static_cast<float>(i % 4), -static_cast<float>(i / 4), 0.0f});
  }
  computeVertexNormals(layout, positions.data(), normals.data());
  for (std::size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(normals[3 * i], 0.0f);
    EXPECT_EQ(normals[3 * i + 1], 0.0f);
    EXPECT_EQ(normals[3 * i + 2], 1.0f);
  }
}

TEST(VertexNormals, FollowASphere) {
  // A patch of the unit sphere with 1 degree a step. The normal equals the position, with an error of the
  // order of the squared step inside and of the step at the edges.
  constexpr std::uint32_t kSize = 21;
  const StreamLayout layout{.epoch = 1,
                            .cloths = {{.vertexCount = kSize * kSize, .rows = kSize, .columns = kSize}}};
  std::vector<float> positions, normals(3 * kSize * kSize);
  for (std::uint32_t i = 0; i < kSize * kSize; ++i) {
    const double longitude = (static_cast<double>(i % kSize) - 10) / 57.3;
    const double latitude = (10 - static_cast<double>(i / kSize)) / 57.3;
    positions.insert(positions.end(), {static_cast<float>(std::sin(longitude) * std::cos(latitude)),
                                       static_cast<float>(std::sin(latitude)),
                                       static_cast<float>(std::cos(longitude) * std::cos(latitude))});
  }
  computeVertexNormals(layout, positions.data(), normals.data());
  for (std::uint32_t i = 0; i < kSize * kSize; ++i) {
    const bool inside = i % kSize > 0 && i % kSize + 1 < kSize && i / kSize > 0 && i / kSize + 1 < kSize;
    EXPECT_LT(degreesBetween(&positions[3 * i], &normals[3 * i]), inside ? 0.02 : 1.0) << i;
  }
}

// A pyramid over a square without its base. At the top the normal is the mean of four sides, at a corner of
// two.
TEST(VertexNormals, AreTheMeanOfAMeshsTriangles) {
  const StreamLayout layout{
      .epoch = 1,
      .cloths = {{.vertexCount = 1, .rows = 1, .columns = 1},
                 {.vertexCount = 5, .triangles = {0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4}}}};
  ASSERT_TRUE(isPossible(layout));
  const std::vector<float> positions{9, 9, 9, 0, 0, 0, 2, 0, 0, 2, 2, 0, 0, 2, 0, 1, 1, 1};
  std::vector<float> normals(18);
  computeVertexNormals(layout, positions.data(), normals.data());
  const float a = 1 / std::sqrt(6.0f);
  const std::vector<float> expected{-a, -a, 2 * a, a, -a, 2 * a, a, a, 2 * a, -a, a, 2 * a, 0, 0, 1};
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(normals[3 + i], expected[i], 1e-6) << i;
}

TEST(VertexNormals, NeedTrianglesOfExistingVertices) {
  for (const std::vector<std::uint32_t>& triangles :
       {std::vector<std::uint32_t>{0, 1}, std::vector<std::uint32_t>{0, 1, 3}}) {
    EXPECT_FALSE(isPossible({.epoch = 1, .cloths = {{.vertexCount = 3, .triangles = triangles}}}));
  }
  EXPECT_FALSE(isPossible(
      {.epoch = 1, .cloths = {{.vertexCount = 4, .rows = 2, .columns = 2, .triangles = {0, 1, 2}}}}));
}

TEST(VertexNormals, PointAlongZWithoutAreaOrTriangles) {
  const StreamLayout layout{
      .epoch = 1,
      .cloths = {{.vertexCount = 4, .rows = 2, .columns = 2}, {.vertexCount = 2, .rows = 0, .columns = 0}}};
  const std::vector<float> positions(18, 1.0f);
  std::vector<float> normals(18);
  computeVertexNormals(layout, positions.data(), normals.data());
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(normals[3 * i + 2], 1.0f);
}

}  // namespace
}  // namespace clothstream::codec
