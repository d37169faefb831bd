// SPDX-License-Identifier: MIT
// Checks of closed meshes, and their normals.
#include "server/model/closed_mesh.h"

#include <gtest/gtest.h>

#include "tests/model/solids.h"

namespace clothstream::model {
namespace {

struct Pieces {
  std::vector<Vec3> vertices;
  std::vector<TriangleCorners> triangles;
};

Pieces tetrahedron() {
  return {{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)},
          {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

std::string problemOf(const Pieces& parts) {
  const auto made = makeClosedMesh(parts.vertices, parts.triangles);
  const auto* problem = std::get_if<ClosedMeshProblem>(&made);
  return problem == nullptr ? "" : problem->text;
}

TEST(ClosedMesh, KnowsTheNeighboursOfATriangle) {
  const auto mesh = std::get<ClosedMesh>(makeClosedMesh(tetrahedron().vertices, tetrahedron().triangles));
  EXPECT_EQ(mesh.neighbours[0], (TriangleCorners{2, 3, 1}));
  EXPECT_EQ(mesh.neighbours[3], (TriangleCorners{0, 2, 1}));
  EXPECT_NEAR(mesh.reach, 1, 1e-5);
}

// A file repeats a vertex for each face with its own normal or texture coordinates.
TEST(ClosedMesh, MergesVerticesInOnePlace) {
  Pieces parts = tetrahedron(), apart;
  for (const TriangleCorners& triangle : parts.triangles) {
    const auto first = static_cast<std::uint32_t>(apart.vertices.size());
    for (const std::uint32_t corner : triangle) apart.vertices.push_back(parts.vertices[corner]);
    apart.triangles.push_back({first, first + 1, first + 2});
  }
  apart.vertices.push_back(Vec3(9, 9, 9));  // of no triangle
  const auto mesh = std::get<ClosedMesh>(makeClosedMesh(apart.vertices, apart.triangles));
  EXPECT_EQ(mesh.vertices.size(), 4u);
}

TEST(ClosedMesh, RefusesAnOpenSurface) {
  Pieces parts{torus(1, 0.3f, 8, 6)->vertices, torus(1, 0.3f, 8, 6)->triangles};
  parts.triangles.pop_back();
  EXPECT_EQ(problemOf(parts), "is not closed: one of its edges has no neighbour");
}

TEST(ClosedMesh, RefusesAFlippedTriangle) {
  Pieces parts = tetrahedron();
  std::swap(parts.triangles[1][0], parts.triangles[1][1]);
  EXPECT_EQ(problemOf(parts), "shows its other side than its neighbour");
}

TEST(ClosedMesh, RefusesAnInsideOutSurface) {
  Pieces parts = tetrahedron();
  for (TriangleCorners& triangle : parts.triangles) std::swap(triangle[0], triangle[1]);
  EXPECT_EQ(problemOf(parts).substr(0, 13), "is inside out");
}

TEST(ClosedMesh, RefusesAnEdgeOfThreeTriangles) {
  Pieces parts = tetrahedron();
  parts.triangles.push_back({0, 2, 1});
  EXPECT_EQ(problemOf(parts), "has an edge that two other triangles have");
}

TEST(ClosedMesh, RefusesUnknownCornersAndFlatTriangles) {
  Pieces parts = tetrahedron();
  parts.triangles[0][0] = 4;
  EXPECT_EQ(problemOf(parts), "has the corner 4, but there are 4 vertices");
  parts = tetrahedron();
  parts.vertices[3] = Vec3(0.5f, 0, 0);
  EXPECT_EQ(problemOf(parts), "has an area below 1e-9 m^2");
  parts.triangles.resize(3);
  EXPECT_EQ(problemOf(parts), "must have 4 to 20000 triangles, but has 3");
}

// At a corner of a box three right angles meet, however its sides are divided.
TEST(ClosedMesh, WeightsTheNormalsOfAVertexByAngle) {
  const Solid box = boxMesh(Vec3(2, 2, 2));
  const std::vector<Eigen::Vector3d> normals = vertexPseudonormals(box->vertices, box->triangles);
  for (std::size_t i = 0; i < normals.size(); ++i)
    EXPECT_LT((normals[i].normalized() - box->vertices[i].cast<double>().normalized()).norm(), 1e-4);
}

}  // namespace
}  // namespace clothstream::model
