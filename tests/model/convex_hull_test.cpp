// SPDX-License-Identifier: MIT
// Valid hulls, and the errors for invalid ones.
#include "server/model/convex_hull.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/model/collider.h"

namespace clothstream::model {
namespace {

using ::testing::HasSubstr;
using Faces = std::vector<std::vector<std::uint32_t>>;

struct Parts {
  std::vector<Vec3> vertices;
  Faces faces;
};

// Pyramid with a square base of 2 m and a height of 1 m.
Parts pyramid() {
  return {{Vec3(-1, 0, -1), Vec3(1, 0, -1), Vec3(1, 0, 1), Vec3(-1, 0, 1), Vec3(0, 1, 0)},
          {{0, 1, 2, 3}, {1, 0, 4}, {2, 1, 4}, {3, 2, 4}, {0, 3, 4}}};
}

// Cube of 12 triangles, as modelling programs export it.
Parts cubeParts() {
  Parts parts;
  for (int i = 0; i < 8; ++i)
    parts.vertices.emplace_back(i & 1 ? 1.f : 0.f, i & 2 ? 1.f : 0.f, i & 4 ? 1.f : 0.f);
  parts.faces = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return parts;
}

std::variant<ConvexHull, HullProblem> make(const Parts& parts) {
  return makeConvexHull(parts.vertices, parts.faces);
}

HullProblem problemOf(const Parts& parts) {
  const auto made = make(parts);
  if (const auto* problem = std::get_if<HullProblem>(&made)) return *problem;
  ADD_FAILURE() << "is taken for a hull";
  return {};
}

TEST(ConvexHull, HasPlanesOfItsFacesAndBoundingBox) {
  const auto hull = std::get<ConvexHull>(make(pyramid()));
  ASSERT_EQ(hull.planes.size(), 5u + 5u);  // the base is a side of the box
  EXPECT_EQ(hull.planes[0].normal, Vec3(0, -1, 0));
  EXPECT_EQ(hull.planes[0].offset, 0);
  EXPECT_TRUE(hull.planes[1].normal.isApprox(Vec3(0, 1, -1).normalized()));
  for (const HalfSpace& plane : hull.planes) {
    float farthest = -1e9f;
    for (const Vec3& vertex : hull.vertices) farthest = std::max(farthest, plane.normal.dot(vertex));
    EXPECT_NEAR(farthest, plane.offset, 1e-6);
  }
  EXPECT_FLOAT_EQ(reachOf(std::make_shared<const ConvexHull>(hull)), Vec3(1, 1, 1).norm());
}

TEST(ConvexHull, MergesPlanesOfCoplanarTriangles) {
  EXPECT_EQ(std::get<ConvexHull>(make(cubeParts())).planes.size(), 6u);
}

TEST(ConvexHull, RefusesAnOpenSurface) {
  Parts parts = pyramid();
  parts.faces.pop_back();
  EXPECT_THAT(problemOf(parts).text, HasSubstr("must be closed"));
}

TEST(ConvexHull, RefusesADent) {
  Parts parts = pyramid();
  parts.vertices[4] = Vec3(0, -0.2f, 0);  // below the base
  EXPECT_THAT(problemOf(parts).text, HasSubstr("must be convex"));
}

TEST(ConvexHull, RefusesAnInsideOutSurface) {
  Parts parts = pyramid();
  for (auto& face : parts.faces) std::ranges::reverse(face);
  EXPECT_THAT(problemOf(parts).text, HasSubstr("counter-clockwise"));
}

TEST(ConvexHull, RefusesAFlippedFace) {
  Parts parts = cubeParts();
  std::ranges::reverse(parts.faces[7]);
  EXPECT_THAT(problemOf(parts).text, HasSubstr("as another face does"));
}

TEST(ConvexHull, RefusesABentFace) {
  Parts parts = pyramid();
  parts.vertices[2].y() = -0.01f;
  const HullProblem problem = problemOf(parts);
  EXPECT_EQ(problem.face, 0u);
  EXPECT_THAT(problem.text, HasSubstr("is not plane"));
}

TEST(ConvexHull, RefusesFacesWithInvalidCorners) {
  Parts parts = pyramid();
  parts.faces[1] = {1, 0};
  EXPECT_THAT(problemOf(parts).text, HasSubstr("has 2 corners"));
  parts.faces[1] = {1, 0, 9};
  EXPECT_THAT(problemOf(parts).text, HasSubstr("names vertex 9; there are 5"));
  parts.faces[1] = {1, 0, 1};
  EXPECT_THAT(problemOf(parts).text, HasSubstr("names vertex 1 twice"));
  EXPECT_EQ(problemOf(parts).face, 1u);
}

TEST(ConvexHull, RefusesAFlatSurface) {
  const Parts sheet{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0)},
                    {{0, 1, 2, 3}, {3, 2, 1, 0}}};
  EXPECT_THAT(problemOf(sheet).text, HasSubstr("is flat"));
}

TEST(ConvexHull, RefusesAnEmptySurface) {
  EXPECT_THAT(problemOf(Parts{}).text, HasSubstr("is flat"));
}

}  // namespace
}  // namespace clothstream::model
