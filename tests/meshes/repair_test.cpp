// SPDX-License-Identifier: MIT
// Repair of meshes: one test per kind of defect, all at once, and random meshes.
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <numbers>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/meshes/mesh_file.h"
#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const MeshLimits kRepairLimits{
    .maxVertices = 10'000, .maxCoordinate = 1000, .minEdge = 0.0001f, .maxNodeSprings = 1000};
const MeshOptions kRepair{.weldDistance = 1e-5f, .repair = true};

MeshSource sourceOf(std::vector<Vec3> vertices, const std::vector<std::vector<std::uint32_t>>& faces) {
  MeshSource source;
  source.vertices = std::move(vertices);
  for (const auto& corners : faces) {
    SourceFace& face = source.faces.emplace_back();
    face.cornerCount = static_cast<std::uint32_t>(corners.size());
    if (!face.isInline()) face.vertices[0] = static_cast<std::uint32_t>(source.corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (face.isInline())
        face.vertices[i] = face.uvs[i] = corners[i];
      else
        source.corners.push_back({corners[i], corners[i]});
  }
  return source;
}

BuiltMesh repaired(const MeshSource& source, const MeshOptions& options = kRepair) {
  const auto refused = buildMesh(source, {.weldDistance = options.weldDistance}, kRepairLimits);
  EXPECT_FALSE(refused) << "needs no repair";
  if (refused) return {};
  EXPECT_THAT(refused.error().text, HasSubstr("set \"repair\""));
  auto built = buildMesh(source, options, kRepairLimits);
  EXPECT_TRUE(built) << built.error().text;
  return built ? std::move(*built) : BuiltMesh();
}

double areaOf(const BuiltMesh& built) {
  return built.mesh.area;
}

// Source with the nodes and triangles of a built mesh. Its repair must change nothing.
MeshSource sourceOf(const model::MeshShape& shape) {
  MeshSource source;
  source.vertices = shape.positions;
  for (const Triangle& t : shape.triangles)
    source.faces.push_back({.cornerCount = 3, .vertices = {t[0], t[1], t[2]}, .uvs = {t[0], t[1], t[2]}});
  source.halves.assign(shape.quads.begin(), shape.quads.end());
  return source;
}

std::size_t pieceCount(const model::MeshShape& shape) {
  std::vector<std::uint32_t> piece(shape.positions.size());
  for (std::uint32_t i = 0; i < piece.size(); ++i) piece[i] = i;
  for (std::size_t round = 0; round < piece.size(); ++round)
    for (const Triangle& t : shape.triangles) {
      const std::uint32_t least = std::min({piece[t[0]], piece[t[1]], piece[t[2]]});
      for (const std::uint32_t node : t) piece[node] = least;
    }
  return std::set(piece.begin(), piece.end()).size();
}

// A letter L of six corners: its area is 3, and a fan from corner 3, which is not convex, would do, but not
// from the others.
TEST(RepairedMesh, HasTrianglesForAPolygonThatIsNotConvex) {
  for (std::uint32_t start = 0; start < 6; ++start) {
    const std::vector<Vec3> corners{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
    std::vector<std::uint32_t> face;
    for (std::uint32_t i = 0; i < 6; ++i) face.push_back((start + i) % 6);
    const BuiltMesh built = repaired(sourceOf(corners, {face}));
    EXPECT_EQ(built.mesh.shape.triangles.size(), 4u);
    EXPECT_NEAR(areaOf(built), 3, 1e-5) << start;
    EXPECT_EQ(built.repairs.triangulatedFaces, 1u);
    EXPECT_THAT(built.repairs.sentences(), ElementsAre(StartsWith("1 polygon was divided into triangles")));
  }
}

// Corners in the middle of sides must not be lost: each is on the border of an ear.
TEST(RepairedMesh, KeepsCornersOnTheSidesOfAPolygon) {
  const std::vector<Vec3> corners{{0, 0, 5}, {1, 0, 5}, {2, 0, 5}, {2, 0, 6},
                                  {2, 0, 7}, {1, 0, 7}, {0, 0, 7}};
  std::vector<std::uint32_t> face{0, 1, 2, 3, 4, 5, 6};
  for (std::size_t start = 0; start < face.size(); ++start) {
    std::ranges::rotate(face, face.begin() + 1);
    const BuiltMesh built = repaired(sourceOf(corners, {face}));
    EXPECT_EQ(built.mesh.shape.triangles.size(), 5u);
    EXPECT_EQ(built.mesh.nodeCount(), 7u);
    EXPECT_NEAR(areaOf(built), 4, 1e-5);
  }
}

// Combs, stars and spirals in every direction keep area and front.
TEST(RepairedMesh, KeepsTheAreaAndFrontOfAnyPolygon) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> radius(0.3, 1);
  for (int shape = 0; shape < 300; ++shape) {
    const std::size_t n = 5 + static_cast<std::size_t>(shape) % 60;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(
        Eigen::Vector4d(radius(random) - 0.6, radius(random) - 0.6, radius(random) - 0.6, radius(random))
            .normalized());
    std::vector<Vec3> corners;
    std::vector<std::uint32_t> face;
    Eigen::Vector3d area = Eigen::Vector3d::Zero(), before = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
      const double r = shape % 3 == 0 ? 1 : shape % 3 == 1 ? radius(random) : (i % 2 == 0 ? 1 : 0.05);
      corners.push_back((turn * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 0)).cast<float>());
      face.push_back(static_cast<std::uint32_t>(i));
    }
    for (std::size_t i = 0; i < n; ++i)
      area += corners[i].cast<double>().cross(corners[(i + 1) % n].cast<double>()) / 2;
    const auto built = buildMesh(sourceOf(corners, {face}), kRepair, kRepairLimits);
    ASSERT_TRUE(built) << built.error().text;
    for (const Triangle& t : built->mesh.shape.triangles) {
      const auto at = [&](std::size_t i) { return built->mesh.shape.positions[t[i]].cast<double>(); };
      before += (at(1) - at(0)).cross(at(2) - at(0)) / 2;
    }
    EXPECT_EQ(built->mesh.shape.triangles.size(), n - 2) << shape;
    EXPECT_NEAR(areaOf(*built), area.norm(), 1e-4) << shape;
    EXPECT_LT((before - area).norm(), 1e-4) << shape;
  }
}

TEST(RepairedMesh, DividesConcavePolygonsOfUpTo1000Corners) {
  const auto comb = [](std::uint32_t n) {
    std::vector<Vec3> corners;
    std::vector<std::uint32_t> face;
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n, r = i % 2 == 0 ? 10 : 9;
      corners.push_back(
          Vec3(static_cast<float>(r * std::cos(angle)), static_cast<float>(r * std::sin(angle)), 0));
      face.push_back(i);
    }
    return sourceOf(corners, {face});
  };
  EXPECT_EQ(repaired(comb(1000)).mesh.shape.triangles.size(), 998u);
  EXPECT_EQ(buildMesh(comb(1002), kRepair, kRepairLimits).error().text,
            "face 0 has 1002 corners and is not convex; at most 1000 can be repaired: triangulate it when "
            "you export");
}

// Convex polygons have no limit, and no corner gets more than five springs of triangles.
TEST(RepairedMesh, MakesAStripOfALargeConvexPolygon) {
  std::vector<Vec3> corners;
  std::vector<std::uint32_t> face;
  for (std::uint32_t i = 0; i < 2000; ++i) {
    const double angle = 2 * std::numbers::pi * i / 2000;
    corners.push_back(Vec3(static_cast<float>(std::cos(angle)), 0, static_cast<float>(std::sin(angle))));
    face.push_back(i);
  }
  const BuiltMesh built = repaired(sourceOf(corners, {face}));
  std::vector<int> uses(2000, 0);
  for (const Triangle& t : built.mesh.shape.triangles)
    for (const std::uint32_t node : t) ++uses[node];
  EXPECT_LE(*std::ranges::max_element(uses), 3);
}

TEST(RepairedMesh, KeepsConvexQuadsAndDividesOthers) {
  // A convex quad next to a dart.
  const BuiltMesh built =
      repaired(sourceOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {3, 0, 0}, {1.2f, 0.5f, 0}, {9, 9, 9}},
                        {{0, 1, 2, 3}, {1, 4, 2, 5}, {6}}));
  EXPECT_THAT(built.mesh.shape.quads, ElementsAre(0u));
  EXPECT_EQ(built.repairs.triangulatedFaces, 1u);
  EXPECT_EQ(built.repairs.droppedFaces, 1u);  // the face with one corner
  EXPECT_NEAR(areaOf(built), 1 + 0.5 * 2 * 1 - 0.5 * 0.2 * 1, 1e-5);
}

TEST(RepairedMesh, LacksFacesWithoutAnArea) {
  const BuiltMesh built =
      repaired(sourceOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 5e-5f, 0}, {2, 0, 0}},
                        {{0, 1, 2}, {0, 2, 3}, {0, 0, 1}, {0, 1, 5}, {1, 4, 2}, {0, 1}, {0, 1, 0, 1, 0}}));
  EXPECT_EQ(built.mesh.shape.triangles.size(), 2u);
  EXPECT_EQ(built.repairs.droppedFaces, 5u);
  EXPECT_THAT(built.repairs.sentences(), ElementsAre("5 faces without an area were dropped."));
}

// Both sides of a cloth, as quads that start at different corners and as triangles.
TEST(RepairedMesh, LacksFacesThatAreThereTwice) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  for (const auto& faces : std::initializer_list<std::vector<std::vector<std::uint32_t>>>{
           {{0, 1, 2, 3}, {0, 3, 2, 1}},
           {{0, 1, 2, 3}, {3, 2, 1, 0}},
           {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {3, 2, 0}}}) {
    const auto built = buildMesh(sourceOf(square, faces), kRepair, kRepairLimits);
    ASSERT_TRUE(built) << built.error().text;
    EXPECT_EQ(built->mesh.shape.triangles.size(), 2u);
    EXPECT_EQ(built->mesh.shape.quads.size(), faces.size() == 2 ? 1u : 0u);
    EXPECT_EQ(built->repairs.droppedDuplicates, 2u);
    EXPECT_EQ(built->repairs.turnedTriangles, 0u);
    EXPECT_THAT(built->repairs.sentences(),
                ElementsAre("2 triangles with the corners of another were dropped."));
  }
}

// A sheet of two triangles, and a third one that stands on the edge between them.
TEST(RepairedMesh, KeepsTheSheetWhereAFlapStandsOnIt) {
  const BuiltMesh built = repaired(
      sourceOf({{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 1, 4}}));
  ASSERT_EQ(built.mesh.nodeCount(), 7u);
  EXPECT_EQ(built.repairs.splitEdges, 1u);
  EXPECT_EQ(built.repairs.addedVertices, 2u);
  EXPECT_EQ(pieceCount(built.mesh.shape), 2u);
  EXPECT_THAT(
      built.repairs.sentences(),
      ElementsAre(
          "1 edge with more than two triangles was split: at most two triangles of an edge are still joined.",
          "2 vertices where several sheets met were divided, which added 2 vertices."));
  const auto node = [&](std::uint32_t vertex) { return built.nodeOfVertex[vertex]; };
  // The sheet has the first nodes of vertices 0 and 1, the flap their copies.
  for (const std::uint32_t corner : built.mesh.shape.triangles[1])
    EXPECT_TRUE(corner == node(0) || corner == node(1) || corner == node(3));
  for (const std::uint32_t vertex : {0u, 1u}) {
    const std::uint32_t copy = built.nextCopy[node(vertex)];
    EXPECT_THAT(built.mesh.shape.triangles[2], testing::Contains(copy));
    EXPECT_EQ(built.mesh.shape.positions[copy], built.mesh.shape.positions[node(vertex)]);
    EXPECT_EQ(built.nextCopy[copy], kNoNode);
  }
}

// Two boxes that share an edge. Each stays closed, whatever the pair that is smoothest.
TEST(RepairedMesh, SplitsSolidsThatShareAnEdge) {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;
  for (const float at : {0.f, 1.f}) {
    const auto first = static_cast<std::uint32_t>(vertices.size());
    for (std::uint32_t i = 0; i < 8; ++i)
      vertices.push_back(Vec3(at + static_cast<float>(i & 1), at + static_cast<float>(i >> 1 & 1),
                              static_cast<float>(i >> 2)));
    for (const std::array<std::uint32_t, 4>& quad : std::initializer_list<std::array<std::uint32_t, 4>>{
             {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}})
      faces.push_back({first + quad[0], first + quad[1], first + quad[2], first + quad[3]});
  }
  const BuiltMesh built = repaired(sourceOf(vertices, faces));
  EXPECT_EQ(built.mesh.nodeCount(), 16u);
  EXPECT_EQ(built.mesh.shape.quads.size(), 12u);
  EXPECT_EQ(built.repairs.splitEdges, 1u);
  EXPECT_EQ(built.repairs.splitVertices, 2u);
  EXPECT_EQ(pieceCount(built.mesh.shape), 2u);
}

TEST(RepairedMesh, DividesVerticesAtWhichSheetsMeet) {
  MeshSource source =
      sourceOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
  const auto joined = buildMesh(source, {}, kRepairLimits);
  ASSERT_TRUE(joined);  // allowed without a repair
  EXPECT_EQ(joined->mesh.nodeCount(), 5u);
  const auto built = buildMesh(source, kRepair, kRepairLimits);
  ASSERT_TRUE(built) << built.error().text;
  EXPECT_EQ(built->mesh.nodeCount(), 6u);
  EXPECT_EQ(built->repairs.splitVertices, 1u);
  EXPECT_THAT(built->repairs.sentences(),
              ElementsAre("1 vertex where several sheets met was divided, which added 1 vertex."));
}

TEST(RepairedMesh, HasItsFrontsOnOneSide) {
  MeshSource source = sourceOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
                               {{0, 1, 2, 3}, {1, 4, 2}, {5, 2, 4}});
  std::swap(source.faces[2].vertices[0], source.faces[2].vertices[1]);
  source.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 0}, {2, 1}};
  std::swap(source.faces[2].uvs[0], source.faces[2].uvs[1]);
  source.parts = {{"wool", 0}, {"silk", 2}};
  const BuiltMesh built = repaired(source);
  EXPECT_EQ(built.repairs.turnedTriangles, 1u);
  for (const Triangle& t : built.mesh.shape.triangles) {
    const auto at = [&](std::size_t i) { return built.mesh.shape.positions[t[i]]; };
    EXPECT_GT((at(1) - at(0)).cross(at(2) - at(0)).z(), 0);
  }
  // Texture coordinates are turned with their triangle, and parts keep their triangles.
  for (std::size_t t = 0; t < 4; ++t)
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_EQ(built.mesh.shape.uvs[built.mesh.shape.uvTriangles[t][i]],
                built.mesh.shape.positions[built.mesh.shape.triangles[t][i]].head<2>());
  ASSERT_EQ(built.mesh.shape.submeshes.size(), 2u);
  EXPECT_EQ(built.mesh.shape.submeshes[1].firstTriangle, 3u);
}

// The majority decides: three quads of a row face down, one up.
TEST(RepairedMesh, TurnsAsFewTrianglesAsPossible) {
  std::vector<Vec3> vertices;
  for (int i = 0; i < 10; ++i)
    vertices.push_back(Vec3(static_cast<float>(i / 2), 0, static_cast<float>(i % 2)));
  const BuiltMesh built =
      repaired(sourceOf(vertices, {{0, 1, 3, 2}, {2, 4, 5, 3}, {4, 6, 7, 5}, {6, 8, 9, 7}}));
  EXPECT_EQ(built.repairs.turnedTriangles, 2u);
  EXPECT_EQ(built.mesh.shape.quads.size(), 4u);
}

TEST(RepairedMesh, CutsAMoebiusStripOnce) {
  constexpr std::uint32_t kQuads = 24;
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;
  for (std::uint32_t i = 0; i < kQuads; ++i) {
    const double around = 2 * std::numbers::pi * i / kQuads;
    for (const double side : {-0.3, 0.3}) {
      const double r = 1 + side * std::cos(around / 2);
      vertices.push_back(
          Eigen::Vector3d(r * std::cos(around), side * std::sin(around / 2), r * std::sin(around))
              .cast<float>());
    }
    const std::uint32_t a = 2 * i, next = 2 * ((i + 1) % kQuads);
    faces.push_back(next != 0 ? std::vector{a, a + 1, next + 1, next} : std::vector{a, a + 1, 0u, 1u});
  }
  const BuiltMesh built = repaired(sourceOf(vertices, faces));
  EXPECT_EQ(built.repairs.cutEdges, 1u);
  EXPECT_EQ(built.mesh.nodeCount(), 2 * kQuads + 2);
  EXPECT_EQ(pieceCount(built.mesh.shape), 1u);
  EXPECT_THAT(built.repairs.sentences(), testing::Contains(HasSubstr("as on a Moebius strip")));
}

TEST(RepairedMesh, StaysAsItIsWithoutDefects) {
  const MeshSource source = sourceOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0, 0}, {2, 1, 0}},
                                     {{0, 1, 2, 3}, {1, 4, 5, 2}});
  const auto plain = buildMesh(source, {.weldDistance = 1e-5f}, kRepairLimits);
  const auto built = buildMesh(source, kRepair, kRepairLimits);
  ASSERT_TRUE(plain && built);
  EXPECT_TRUE(built->repairs.isEmpty());
  EXPECT_TRUE(built->repairs.sentences().empty());
  EXPECT_TRUE(built->nextCopy.empty());
  EXPECT_EQ(built->mesh.shape.positions, plain->mesh.shape.positions);
  EXPECT_EQ(built->mesh.shape.triangles, plain->mesh.shape.triangles);
  EXPECT_EQ(built->mesh.shape.quads, plain->mesh.shape.quads);
  EXPECT_EQ(built->nodeOfVertex, plain->nodeOfVertex);
}

TEST(RepairedMesh, HasNoneOfAllDefectsAtOnce) {
  const auto source = parseObj(R"(o all
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 2 0 0
v 2 1 0
v 0.5 2 0
v 1 0 1
v 1 1 1
v 1 0 0.00002
f 1 2 3 4
f 6 5 2 3
f 4 3 7
f 2 3 9 8
f 1 2 3 4
f 2 10 3
f 1 2 1
f 1 2 3 5 7
)");
  ASSERT_TRUE(source) << source.error();
  const BuiltMesh built = repaired(*source);
  EXPECT_GT(built.repairs.triangulatedFaces, 0u);
  EXPECT_EQ(built.repairs.droppedFaces, 2u);
  EXPECT_EQ(built.repairs.droppedDuplicates, 2u);
  EXPECT_GT(built.repairs.splitEdges, 0u);
  EXPECT_GT(built.repairs.turnedTriangles, 0u);
  EXPECT_GT(built.repairs.addedVertices, 0u);
}

TEST(RepairedMesh, IsTheSameForTheSameFile) {
  std::mt19937 random(5);
  std::uniform_int_distribution<std::uint32_t> corner(0, 39);
  std::vector<Vec3> vertices;
  for (int i = 0; i < 40; ++i)
    vertices.push_back(Vec3(static_cast<float>(i % 7), static_cast<float>(i % 5), static_cast<float>(i % 3)));
  std::vector<std::vector<std::uint32_t>> faces(200, std::vector<std::uint32_t>(4));
  for (auto& face : faces)
    for (std::uint32_t& vertex : face) vertex = corner(random);
  const BuiltMesh once = repaired(sourceOf(vertices, faces)), again = repaired(sourceOf(vertices, faces));
  EXPECT_EQ(once.mesh.shape.positions, again.mesh.shape.positions);
  EXPECT_EQ(once.mesh.shape.triangles, again.mesh.shape.triangles);
  EXPECT_EQ(once.nextCopy, again.nextCopy);
}

// Random faces on few vertices have every defect. The result obeys all rules, and a second repair changes
// nothing.
TEST(RepairedMesh, ObeysEveryRuleForRandomFaces) {
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    std::mt19937 random(seed);
    const auto below = [&](std::uint32_t end) { return static_cast<std::uint32_t>(random() % end); };
    const std::uint32_t vertexCount = 3 + below(14), faceCount = 1 + below(30), side = 2 + below(4);
    std::vector<Vec3> vertices;
    for (std::uint32_t i = 0; i < vertexCount; ++i)
      vertices.push_back(Vec3(static_cast<float>(below(side)), static_cast<float>(below(side)),
                              static_cast<float>(below(2))) *
                         (seed % 2 == 0 ? 1.f : 7e-5f));
    std::vector<std::vector<std::uint32_t>> faces;
    for (std::uint32_t f = 0; f < faceCount; ++f) {
      const std::uint32_t corners = below(4) == 0 ? 1 + below(9) : 3 + below(2);
      faces.emplace_back();
      for (std::uint32_t i = 0; i < corners; ++i) faces.back().push_back(below(vertexCount));
    }
    const auto built = buildMesh(sourceOf(vertices, faces), kRepair, kRepairLimits);
    if (!built) {
      EXPECT_THAT(built.error().text,
                  testing::AnyOf(HasSubstr("nothing is left after the repair"), HasSubstr("mean length")))
          << seed;
      continue;
    }
    const MeshSource result = sourceOf(built->mesh.shape);
    const auto plain = buildMesh(result, {}, kRepairLimits);
    ASSERT_TRUE(plain) << seed << ": " << plain.error().text;
    EXPECT_EQ(plain->mesh.shape.positions, built->mesh.shape.positions) << seed;
    EXPECT_EQ(plain->mesh.shape.quads, built->mesh.shape.quads) << seed;
    // Every vertex with a node leads to all of its copies.
    std::vector<bool> isReached(built->mesh.nodeCount(), false);
    for (std::uint32_t node : built->nodeOfVertex)
      while (node != kNoNode) {
        isReached[node] = true;
        node = built->nextCopy.empty() ? kNoNode : built->nextCopy[node];
      }
    EXPECT_EQ(std::ranges::count(isReached, false), 0) << seed;
  }
}

}  // namespace
}  // namespace clothstream::meshes
