// SPDX-License-Identifier: MIT
// Surfaces of a real room, from good and from bad input.
#include "server/model/surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/model/surfaces.h"

namespace clothstream::model {
namespace {

const MadeSurface& madeOf(const std::variant<MadeSurface, SurfaceProblem>& result) {
  return std::get<MadeSurface>(result);
}
const SurfaceProblem& problemOf(const std::variant<MadeSurface, SurfaceProblem>& result) {
  return std::get<SurfaceProblem>(result);
}

TEST(Surface, ConnectsTrianglesAndKnowsItsRim) {
  const Surface square = surfaceOf(flat(1, 1));
  ASSERT_EQ(square.triangles.size(), 2u);
  EXPECT_EQ(square.neighbours[0][1], 1u);
  EXPECT_EQ(square.neighbours[1][0], 0u);
  EXPECT_EQ(square.neighbours[0][0], 0u);
  EXPECT_EQ(square.rims[0], 0b101);  // all but the edge between both
  EXPECT_EQ(square.rims[1], 0b110);
  EXPECT_EQ(square.low, Vec3(-0.5f, 0, -0.5f));
  EXPECT_EQ(square.high, Vec3(0.5f, 0, 0.5f));
  const Surface larger = surfaceOf(flat(1, 1, 4));
  EXPECT_GT(std::ranges::count(larger.rims, 0), 0);  // those in the middle
}

TEST(Surface, MergesVerticesInTheSamePlace) {
  const Triangles from = flat(1, 1);
  Triangles soup;
  for (const TriangleCorners& triangle : from.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices.size());
    for (const std::uint32_t corner : triangle) soup.vertices.push_back(from.vertices[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const Surface made = surfaceOf(soup), square = surfaceOf(from);
  EXPECT_EQ(made.vertices.size(), 4u);
  EXPECT_EQ(made.rims, square.rims);
}

TEST(Surface, EndsAtEdgesThatAreNotManifold) {
  Triangles turned = flat(1, 1);
  std::swap(turned.triangles[1][0], turned.triangles[1][1]);
  for (const std::uint8_t rims : surfaceOf(turned).rims) EXPECT_EQ(rims, 0b111);
  Triangles fin = flat(1, 1);
  fin.vertices.emplace_back(0, 1, 0);
  fin.triangles.push_back({1, 2, 4});
  for (const std::uint8_t rims : surfaceOf(fin).rims) EXPECT_EQ(rims, 0b111);
}

TEST(Surface, LeavesOutTrianglesThatHaveNoNormal) {
  Triangles from = flat(1, 1);
  const auto added = static_cast<std::uint32_t>(from.vertices.size());
  from.vertices.emplace_back(5, 0, 0);
  from.vertices.emplace_back(6, 0, 0);
  from.vertices.emplace_back(7, 0, 0);
  from.vertices.emplace_back(6, 0.00005f, 0);
  from.triangles.push_back({added, added, added + 1});      // a corner twice
  from.triangles.push_back({added, added + 1, added + 2});  // a line
  from.triangles.push_back({added, added + 3, added + 2});  // 0.05 mm high
  const auto result = makeSurface(from.vertices, from.triangles);
  EXPECT_EQ(madeOf(result).dropped, 3u);
  EXPECT_EQ(madeOf(result).surface.triangles.size(), 2u);
  EXPECT_EQ(madeOf(result).surface.vertices.size(), 4u);
  EXPECT_EQ(madeOf(result).surface.high.x(), 0.5f);
}

TEST(Surface, RefusesWhatNothingCanTouch) {
  EXPECT_NE(problemOf(makeSurface({}, {})).text.find("1 to 50000 triangles, but has 0"), std::string::npos);
  const auto thin = makeSurface({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(2, 0, 0)}, {{0, 1, 2}});
  EXPECT_NE(problemOf(thin).text.find("0.0001 m"), std::string::npos);
  const std::vector<TriangleCorners> many(kMaxSurfaceTriangles + 1, {0, 1, 2});
  EXPECT_NE(problemOf(makeSurface(flat(1, 1).vertices, many)).text.find("but has 50001"), std::string::npos);
}

TEST(Surface, NamesTheVertexOrTriangleThatIsWrong) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  for (const float bad : {nan, infinity, -infinity, 100.1f, -3e38f}) {
    for (int axis = 0; axis < 3; ++axis) {
      Triangles from = flat(1, 1);
      from.vertices[2][axis] = bad;
      const auto result = makeSurface(from.vertices, from.triangles);
      EXPECT_EQ(problemOf(result).vertex, 2u) << bad;
      EXPECT_NE(problemOf(result).text.find("-100 to 100 m"), std::string::npos);
    }
  }
  Triangles from = flat(1, 1);
  from.triangles[1][2] = 4;
  const auto result = makeSurface(from.vertices, from.triangles);
  EXPECT_EQ(problemOf(result).triangle, 1u);
  EXPECT_NE(problemOf(result).text.find("corner 4, but there are 4 vertices"), std::string::npos);
}

TEST(Surface, TakesTheLargestTriangles) {
  const Surface made = surfaceOf(flat(200, 200));
  EXPECT_EQ(made.triangles.size(), 2u);
  EXPECT_EQ(made.high.x(), kMaxSurfaceExtent);
}

}  // namespace
}  // namespace clothstream::model
