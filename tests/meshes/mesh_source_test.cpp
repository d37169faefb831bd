// SPDX-License-Identifier: MIT
// Welding, order, quads, and every check of a source.
#include "server/meshes/mesh_source.h"

#include <cmath>
#include <ctime>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/model/meshes.h"

namespace clothstream::meshes {
namespace {

using model::Vec3;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const MeshLimits kLimits{
    .maxVertices = 10'000, .maxCoordinate = 1000, .minEdge = 0.0001f, .maxNodeSprings = 100};

SourceFace triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return {.cornerCount = 3, .vertices = {a, b, c}, .uvs = {a, b, c}};
}
SourceFace quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  return {.cornerCount = 4, .vertices = {a, b, c, d}, .uvs = {a, b, c, d}};
}

// Unit square of two triangles, counter-clockwise seen from +Z.
MeshSource square() {
  MeshSource source;
  source.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  source.faces = {triangle(0, 1, 2), triangle(0, 2, 3)};
  return source;
}

// Splits every vertex, so that no two triangles share one, and shuffles them.
MeshSource soup(const model::MeshShape& shape, float noise) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(-noise, noise);
  MeshSource source;
  for (const model::Triangle& corners : shape.triangles) {
    const auto first = static_cast<std::uint32_t>(source.vertices.size());
    for (const std::uint32_t node : corners)
      source.vertices.push_back(shape.positions[node] + Vec3(unit(random), unit(random), unit(random)));
    source.faces.push_back(triangle(first, first + 1, first + 2));
  }
  std::ranges::shuffle(source.faces, random);
  return source;
}

TEST(BuildMesh, WeldsVerticesWithinTheWeldDistance) {
  const model::MeshShape disc = model::disc(9, 0.5f);
  for (const float noise : {0.0f, 2e-6f}) {
    const auto built = buildMesh(soup(disc, noise), {.weldDistance = 1e-5f}, kLimits);
    ASSERT_TRUE(built) << built.error().text;
    EXPECT_EQ(built->mesh.nodeCount(), disc.positions.size());
    EXPECT_EQ(built->mesh.shape.triangles.size(), disc.triangles.size());
    EXPECT_EQ(built->mesh.links.size(), model::makeMesh(disc).links.size());
  }
  const auto apart = buildMesh(soup(disc, 0), {.weldDistance = 0}, kLimits);
  ASSERT_TRUE(apart) << apart.error().text;
  EXPECT_EQ(apart->mesh.nodeCount(), 3 * disc.triangles.size());
  const auto same = buildMesh(soup(disc, 0), {.weldDistance = 1e-30f}, kLimits);
  ASSERT_TRUE(same) << same.error().text;
  EXPECT_EQ(same->mesh.nodeCount(), disc.positions.size());
}

TEST(BuildMesh, KeepsPositionsWhenRenumbering) {
  const MeshSource source = soup(model::disc(5, 0.5f), 0);
  const auto built = buildMesh(source, {.weldDistance = 1e-5f}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  for (std::size_t i = 0; i < source.vertices.size(); ++i)
    EXPECT_EQ(built->mesh.shape.positions[built->nodeOfVertex[i]], source.vertices[i]) << i;
  for (std::size_t f = 0; f < source.faces.size(); ++f)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_EQ(built->mesh.shape.triangles[f][corner],
                built->nodeOfVertex[source.faces[f].vertices[corner]]);
}

// Mean distance of edge ends in memory: far below that of a random order.
TEST(BuildMesh, PlacesNeighboursCloseInMemory) {
  MeshSource source = soup(model::disc(20, 0.5f), 0);
  const auto built = buildMesh(source, {.weldDistance = 1e-5f}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  double reach = 0;
  for (const model::SpringLink& link : built->mesh.links) reach += link.b - link.a;
  reach /= static_cast<double>(built->mesh.links.size());
  EXPECT_LT(reach, built->mesh.nodeCount() / 20.0);  // a random order gives a third of the nodes
}

TEST(BuildMesh, KeepsItsOwnOrder) {
  const auto once = buildMesh(soup(model::disc(12, 0.5f), 0), {.weldDistance = 1e-5f}, kLimits);
  ASSERT_TRUE(once);
  MeshSource again;
  again.vertices = once->mesh.shape.positions;
  for (const model::Triangle& corners : once->mesh.shape.triangles)
    again.faces.push_back(triangle(corners[0], corners[1], corners[2]));
  const auto twice = buildMesh(again, {}, kLimits);
  ASSERT_TRUE(twice);
  EXPECT_EQ(twice->mesh.shape.positions, once->mesh.shape.positions);
  EXPECT_EQ(twice->mesh.shape.triangles, once->mesh.shape.triangles);
}

TEST(BuildMesh, ScalesRotatesAndTranslatesInThisOrder) {
  const auto built = buildMesh(
      square(),
      {.pose = {Vec3(1, 2, 3), model::Quaternion(std::sqrt(0.5f), 0, std::sqrt(0.5f), 0)}, .scale = 2},
      kLimits);
  ASSERT_TRUE(built) << built.error().text;
  const Vec3 corner = built->mesh.shape.positions[built->nodeOfVertex[1]];  // (1, 0, 0) turned to -Z
  EXPECT_TRUE(corner.isApprox(Vec3(1, 2, 1), 1e-6f)) << corner.transpose();
}

TEST(BuildMesh, LeavesOutVerticesWithoutFaces) {
  MeshSource source = square();
  source.vertices.insert(source.vertices.begin(), Vec3(9, 9, 9));
  for (SourceFace& face : source.faces)
    for (std::uint32_t& vertex : face.vertices) ++vertex;
  const auto built = buildMesh(source, {}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  EXPECT_EQ(built->mesh.nodeCount(), 4u);
  EXPECT_EQ(built->nodeOfVertex[0], kNoNode);
}

TEST(BuildMesh, SplitsQuadsAlongTheShorterDiagonalAndAddsShearSprings) {
  MeshSource source = square();
  source.vertices[2] = {1.5f, 1.5f, 0};
  source.faces = {quad(0, 1, 2, 3)};
  const auto built = buildMesh(source, {}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  EXPECT_THAT(built->mesh.shape.quads, ElementsAre(0u));
  std::uint32_t shared = 0;
  for (const std::uint32_t node : built->mesh.shape.triangles[0])
    shared += static_cast<std::uint32_t>(std::ranges::count(built->mesh.shape.triangles[1], node));
  EXPECT_EQ(shared, 2u);
  EXPECT_EQ(std::ranges::count(built->mesh.links, model::SpringKind::shear, &model::SpringLink::kind), 2);
  for (const model::Triangle& half : built->mesh.shape.triangles)  // 1 and 3 are the diagonal
    for (const std::uint32_t vertex : {1u, 3u})
      EXPECT_TRUE(std::ranges::count(half, built->nodeOfVertex[vertex]));
}

TEST(BuildMesh, KeepsTextureCoordinatesAtSeams) {
  MeshSource source = soup(model::disc(2, 0.5f), 0);
  for (const Vec3& vertex : source.vertices)
    source.uvs.emplace_back(vertex.x() + static_cast<float>(source.uvs.size()), vertex.z());
  const auto built = buildMesh(source, {.weldDistance = 1e-5f}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  EXPECT_EQ(built->mesh.shape.uvs, source.uvs);
  for (std::size_t f = 0; f < source.faces.size(); ++f)
    for (std::size_t corner = 0; corner < 3; ++corner)
      EXPECT_EQ(built->mesh.shape.uvTriangles[f][corner], source.faces[f].uvs[corner]);
}

TEST(BuildMesh, CountsTheTrianglesOfEachPart) {
  MeshSource source = square();
  source.vertices.push_back({2, 0, 0});
  source.vertices.push_back({2, 1, 0});
  source.faces.push_back(quad(1, 4, 5, 2));
  source.parts = {{"cotton", 0}, {"silk", 2}, {"nothing", 3}};
  const auto built = buildMesh(source, {}, kLimits);
  ASSERT_TRUE(built) << built.error().text;
  ASSERT_EQ(built->mesh.shape.submeshes.size(), 2u);
  EXPECT_EQ(built->mesh.shape.submeshes[0].name, "cotton");
  EXPECT_EQ(built->mesh.shape.submeshes[0].triangleCount, 2u);
  EXPECT_EQ(built->mesh.shape.submeshes[1].firstTriangle, 2u);
  EXPECT_EQ(built->mesh.shape.submeshes[1].triangleCount, 2u);
}

struct BadCase {
  const char* says;
  std::function<void(MeshSource&)> spoil;
};

TEST(BuildMesh, RefusesInvalidSources) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const BadCase cases[] = {
      {"has no vertices", [](MeshSource& s) { s.vertices.clear(); }},
      {"has no faces", [](MeshSource& s) { s.faces.clear(); }},
      {"10001 vertices; at most 10000", [](MeshSource& s) { s.vertices.resize(10'001, Vec3::Zero()); }},
      {"20001 faces; at most 20000", [](MeshSource& s) { s.faces.resize(20'001); }},
      {"vertex 2 is at (1, nan, 0)", [&](MeshSource& s) { s.vertices[2].y() = nan; }},
      {"vertex 1 is at (inf, 0, 0)", [](MeshSource& s) { s.vertices[1].x() = INFINITY; }},
      {"texture coordinate 3 is not finite",
       [&](MeshSource& s) { s.uvs.assign(4, model::Uv(0, 0)), s.uvs[3].x() = nan; }},
      {"vertex 1 is at (2000, 0, 0) m", [](MeshSource& s) { s.vertices[1].x() = 2000; }},
      {"face 1 names vertex 4; there are 4", [](MeshSource& s) { s.faces[1].vertices[2] = 4; }},
      {"face 0 names texture coordinate 9; there are 4",
       [](MeshSource& s) { s.uvs.assign(4, model::Uv(0, 0)), s.faces[0].uvs[1] = 9; }},
      {"face 1 is degenerate: its vertices 0 and 0 are the same node",
       [](MeshSource& s) { s.faces[1].vertices[2] = 0; }},
      {"face 0 is degenerate: its vertices 1 and 2 are the same node",
       [](MeshSource& s) { s.vertices[2] = Vec3(1, 5e-6f, 0); }},
      {"face 0 is degenerate: its vertices 1 and 2 lie 5e-05 m apart; at least 0.0001",
       [](MeshSource& s) { s.vertices[2] = Vec3(1, 5e-5f, 0); }},
      {"face 0 is degenerate: its vertices 0, 1 and 2 lie on one line",
       [](MeshSource& s) { s.vertices[2] = Vec3(2, 0, 0); }},
      {"the edge between vertices 0 and 2 is not manifold: faces 0, 1 and 2",
       [](MeshSource& s) {
         s.vertices.push_back({0, 0, 1}), s.faces.push_back(triangle(0, 2, 4));
       }},
      {"faces 0 and 1 run the same way along the edge between vertices 0 and 2",
       [](MeshSource& s) { s.faces[1] = triangle(0, 3, 2); }},
      {"run the same way", [](MeshSource& s) { s.faces[1] = s.faces[0]; }},
  };
  for (const BadCase& bad : cases) {
    MeshSource source = square();
    bad.spoil(source);
    const auto built = buildMesh(source, {.weldDistance = 1e-5f}, kLimits);
    ASSERT_FALSE(built) << bad.says;
    EXPECT_THAT(built.error().text, HasSubstr(bad.says));
  }
}

// A cone with this many triangles around its first vertex.
MeshSource cone(std::uint32_t triangles) {
  MeshSource source;
  source.vertices = {{0, 0, 1}};
  for (std::uint32_t i = 0; i <= triangles; ++i) {
    const double angle = 6.0 * i / triangles;
    source.vertices.push_back(
        Vec3(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)), 0));
    if (i > 0) source.faces.push_back(triangle(0, i, i + 1));
  }
  return source;
}

TEST(BuildMesh, RefusesTooManySpringsAtAVertex) {
  EXPECT_TRUE(buildMesh(cone(99), {}, kLimits));
  EXPECT_THAT(buildMesh(cone(100), {}, kLimits).error().text,
              AllOf(HasSubstr("vertex 0"), HasSubstr("more than 100 springs")));
}

// Cell indices that differ only above bit 20 must not collide. They did, and this mesh took 8 to 23 s.
// Processor time does not depend on other programs; this takes 0.1 s.
TEST(BuildMesh, WeldsVerticesWithEqualLowBitsInLinearTime) {
  constexpr int kSide = 256;
  MeshSource source;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      source.vertices.push_back(Vec3(static_cast<float>(x) / 128, static_cast<float>(y) / 128, 0));
  source.faces = {triangle(0, 1, kSide)};
  MeshLimits limits = kLimits;
  limits.maxVertices = kSide * kSide;
  const std::clock_t before = std::clock();
  EXPECT_TRUE(buildMesh(source, {.weldDistance = 0x1p-30f}, limits));
  EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 4.0);
}

}  // namespace
}  // namespace clothstream::meshes
