// SPDX-License-Identifier: MIT
// Measures of positions, compared with values that follow from the geometry.
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "clients/measure/energy.h"
#include "clients/measure/intersections.h"
#include "clients/measure/penetration.h"
#include "clients/measure/strain.h"
#include "clients/measure/surface.h"

namespace clothstream::measure {
namespace {

cs_collider colliderOf(cs_shape shape) {
  cs_collider collider{};
  collider.shape = shape;
  collider.orientation[3] = 1;
  return collider;
}

double depthIn(const cs_collider& collider, const Point& point) {
  return Solid(collider, {}, {}).depthOf(point);
}

// Two triangles that form a square of 1 m, as a mesh.
Surface square() {
  Surface surface;
  surface.rest = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
  surface.triangles = {{0, 1, 2}, {0, 2, 3}};
  surface.cloths = {{"square", 0, 4, 0, 0, 0, 2}};
  return surface;
}

TEST(Penetration, SphereHasTheDistanceToItsSurface) {
  cs_collider sphere = colliderOf(CS_SHAPE_SPHERE);
  sphere.radius = 0.5f;
  sphere.position[1] = 2;
  EXPECT_DOUBLE_EQ(depthIn(sphere, {0, 2, 0}), 0.5);
  EXPECT_DOUBLE_EQ(depthIn(sphere, {0.25, 2, 0}), 0.25);
  EXPECT_DOUBLE_EQ(depthIn(sphere, {0, 3, 0}), -0.5);
}

TEST(Penetration, CapsuleFollowsItsSegmentAndOrientation) {
  cs_collider capsule = colliderOf(CS_SHAPE_CAPSULE);
  capsule.radius = capsule.top_radius = 0.25f;
  capsule.length = 2;
  EXPECT_DOUBLE_EQ(depthIn(capsule, {0, 0.9, 0}), 0.25);
  EXPECT_NEAR(depthIn(capsule, {0, 1.2, 0}), 0.05, 1e-12);
  // A quarter turn about Z puts the segment along -X.
  capsule.orientation[2] = capsule.orientation[3] = std::sqrt(0.5f);
  EXPECT_NEAR(depthIn(capsule, {-1.2, 0, 0}), 0.05, 1e-6);
  EXPECT_NEAR(depthIn(capsule, {0, 0.9, 0}), -0.65, 1e-6);
}

TEST(Penetration, CapsuleMayBeTapered) {
  cs_collider limb = colliderOf(CS_SHAPE_CAPSULE);
  limb.radius = 0.5f;
  limb.top_radius = 1.5f;
  limb.length = 2;
  EXPECT_DOUBLE_EQ(depthIn(limb, {0, 2, 0}), 0.5);
  EXPECT_DOUBLE_EQ(depthIn(limb, {0, -2, 0}), -0.5);
  // On the mantle, which leans by 30 degrees.
  EXPECT_NEAR(depthIn(limb, {1.125 * std::sqrt(0.75), 0.25 - 1.125 / 2, 0}), 0, 1e-12);
}

TEST(Penetration, PlaneIsTheHalfSpaceBelowIt) {
  cs_collider plane = colliderOf(CS_SHAPE_PLANE);
  plane.position[1] = -1;
  EXPECT_DOUBLE_EQ(depthIn(plane, {7, -1.5, 3}), 0.5);
  EXPECT_DOUBLE_EQ(depthIn(plane, {7, 0, 3}), -1);
}

TEST(Penetration, BoxHasTheDistanceToItsNearestSide) {
  cs_collider box = colliderOf(CS_SHAPE_BOX);
  box.size[0] = 2;
  box.size[1] = 4;
  box.size[2] = 6;
  EXPECT_DOUBLE_EQ(depthIn(box, {0, 0, 0}), 1);
  EXPECT_DOUBLE_EQ(depthIn(box, {0, -1.75, 0}), 0.25);
  EXPECT_LT(depthIn(box, {0, 0, 3.5}), 0);
}

TEST(Penetration, HullHasTheDistanceToItsNearestFace) {
  const std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  const std::vector<std::uint32_t> triangles{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const Solid hull(colliderOf(CS_SHAPE_HULL), corners, triangles);
  EXPECT_NEAR(hull.depthOf({0.2, 0.1, 0.3}), 0.1, 1e-12);
  EXPECT_NEAR(hull.depthOf({0.3, 0.3, 0.3}), 0.1 / std::sqrt(3.0), 1e-12);
  EXPECT_LT(hull.depthOf({0.5, 0.5, 0.5}), 0);
}

// Two separate bodies: a point between them is in front of faces of both.
TEST(Penetration, MeshHasTheDistanceToItsNearestTriangle) {
  std::vector<float> corners{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  std::vector<std::uint32_t> triangles{0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  for (std::size_t i = 0; i < 12; ++i) corners.push_back(corners[i] + (i % 3 == 0 ? 5.0f : 0.0f));
  for (std::size_t i = 0; i < 12; ++i) triangles.push_back(triangles[i] + 4);
  const Solid mesh(colliderOf(CS_SHAPE_HULL), corners, triangles);
  EXPECT_NEAR(mesh.depthOf({0.2, 0.1, 0.3}), 0.1, 1e-12);
  EXPECT_NEAR(mesh.depthOf({5.3, 0.3, 0.3}), 0.1 / std::sqrt(3.0), 1e-12);
  EXPECT_LE(mesh.depthOf({3, 0.1, 0.1}), 0);
  EXPECT_LE(mesh.depthOf({0.5, 0.5, 0.5}), 0);
}

TEST(Penetration, IsThatOfTheDeepestVertex) {
  cs_collider plane = colliderOf(CS_SHAPE_PLANE);
  cs_collider sphere = colliderOf(CS_SHAPE_SPHERE);
  sphere.radius = 1;
  const std::vector<Solid> solids{Solid(plane, {}, {}), Solid(sphere, {}, {})};
  const std::vector<float> positions{0, 5, 0, 0, -0.25f, 4, 0, 0.5f, 0, 0, -9, 0};
  EXPECT_DOUBLE_EQ(penetrationOf(solids, positions, 0, 1), 0);
  EXPECT_DOUBLE_EQ(penetrationOf(solids, positions, 0, 2), 0.25);
  EXPECT_DOUBLE_EQ(penetrationOf(solids, positions, 0, 3), 0.5);
  EXPECT_DOUBLE_EQ(penetrationOf(solids, positions, 3, 1), 9);
}

TEST(Strain, UsesRowsAndColumnsOfAGridAndAllEdgesOfAMesh) {
  EXPECT_EQ(structuralEdges(square(), square().cloths[0]).size(), 5u);
  Surface grid = square();
  grid.cloths[0].rows = grid.cloths[0].columns = 2;
  grid.rest = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  grid.triangles = {{0, 2, 1}, {1, 2, 3}};
  EXPECT_EQ(structuralEdges(grid, grid.cloths[0]).size(), 4u);
}

TEST(Strain, LeavesOutEdgesWithoutALength) {
  Surface surface = square();
  surface.rest.assign({0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0});
  EXPECT_EQ(structuralEdges(surface, surface.cloths[0]).size(), 4u);
}

TEST(Strain, FiguresAreOfAbsoluteValues) {
  const StrainFigures figures = figuresOf({-0.5, 0.25, 0, 0.25});
  EXPECT_DOUBLE_EQ(figures.mean, 0.25);
  EXPECT_DOUBLE_EQ(figures.largest, 0.5);
  EXPECT_DOUBLE_EQ(figuresOf({}).largest, 0);
  std::vector<double> hundred(100, 0.01);
  hundred[7] = 1;
  EXPECT_DOUBLE_EQ(figuresOf(hundred).p99, 0.01);
}

TEST(Masses, FollowTheAreaOfAMesh) {
  const Surface surface = square();
  EXPECT_DOUBLE_EQ(areaOf(surface, surface.cloths[0]), 1);
  const std::vector<double> masses = massesOf(surface, surface.cloths[0], 0.6);
  EXPECT_NEAR(masses[0], 0.2, 1e-12);
  EXPECT_NEAR(masses[1], 0.1, 1e-12);
  EXPECT_NEAR(masses[0] + masses[1] + masses[2] + masses[3], 0.6, 1e-12);
}

TEST(Energy, IsThatOfMovingMasses) {
  const std::vector<double> masses{1, 2};
  const std::vector<float> before{0, 0, 0, 0, 0, 0}, after{1, 0, 0, 0, 2, 0};
  EXPECT_DOUBLE_EQ(kineticEnergy(masses, 0, before, after, 0.5), 0.5 * 1 * 4 + 0.5 * 2 * 16);
  EXPECT_DOUBLE_EQ(gravityEnergy(masses, 0, after, {0, -10, 0}), 40);
}

// Every edge against every triangle.
std::size_t countAll(const std::vector<Triangle>& triangles, const std::vector<float>& positions) {
  std::size_t count = 0;
  for (const Triangle& edges : triangles)
    for (std::size_t i = 0; i < 3; ++i)
      for (const Triangle& other : triangles) {
        if (&other == &edges) continue;
        // Two triangles alone, with the edge as a triangle without an area.
        Intersections pair(std::vector<Triangle>{{edges[i], edges[(i + 1) % 3], edges[i]}, other});
        const std::uint32_t low = std::min(edges[i], edges[(i + 1) % 3]);
        const Intersections::Range range{low, low + 1};
        count += pair.count(positions, std::span(&range, 1))[0];
      }
  return count;
}

TEST(Intersections, FindsWhatAnExhaustiveSearchFinds) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> coordinate(0, 1);
  std::vector<Triangle> triangles;
  std::vector<float> positions;
  for (std::uint32_t i = 0; i < 40; ++i) {
    triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    for (int k = 0; k < 9; ++k) positions.push_back(coordinate(random));
  }
  const Intersections::Range all;
  const std::size_t found = Intersections(triangles).count(positions, std::span(&all, 1))[0];
  EXPECT_GT(found, 50u);
  EXPECT_EQ(found, countAll(triangles, positions));
}

TEST(Intersections, DividesByClothAndIgnoresPositionsThatAreNotFinite) {
  const std::vector<Triangle> triangles{{0, 1, 2}, {3, 4, 5}};
  std::vector<float> positions{0, 0, 0, 4, 0, 0, 0, 4, 0, 1, 1, -1, 1, 1.5f, 3, 2, 1, 3};
  const std::array<Intersections::Range, 2> cloths{{{0, 3}, {3, 6}}};
  Intersections intersections(triangles);
  EXPECT_EQ(intersections.count(positions, cloths), (std::vector<std::size_t>{0, 2}));
  positions[0] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(intersections.count(positions, cloths), (std::vector<std::size_t>{0, 0}));
  EXPECT_EQ(Intersections({}).count(positions, cloths), (std::vector<std::size_t>{0, 0}));
}

}  // namespace
}  // namespace clothstream::measure
