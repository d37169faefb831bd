// SPDX-License-Identifier: MIT
// Springs, masses and stability of meshes.
#include <algorithm>
#include <numbers>
#include <tuple>

#include <gtest/gtest.h>

#include "server/model/stability.h"
#include "tests/model/meshes.h"

namespace clothstream::model {
namespace {

MeshShape triangles(std::vector<Vec3> positions, std::vector<Triangle> corners) {
  MeshShape shape;
  shape.positions = std::move(positions);
  shape.triangles = std::move(corners);
  return shape;
}

using Link = std::tuple<std::uint32_t, std::uint32_t, SpringKind>;

std::vector<Link> ends(const std::vector<SpringLink>& links) {
  std::vector<Link> all;
  for (const SpringLink& link : links) all.emplace_back(link.a, link.b, link.kind);
  return all;
}

TEST(MeshLinks, EqualThoseOfAGridForQuads) {
  for (const auto& [rows, columns] :
       {std::pair(2u, 2u), std::pair(2u, 5u), std::pair(6u, 2u), std::pair(7u, 5u)}) {
    const std::vector<SpringLink> expected = springLinks(grid(rows, columns));
    const std::vector<SpringLink> links = springLinks(asMesh(grid(rows, columns)));
    ASSERT_EQ(ends(links), ends(expected)) << rows << " x " << columns;
    for (std::size_t i = 0; i < links.size(); ++i)
      EXPECT_NEAR(links[i].restLength, expected[i].restLength, 1e-6f);
  }
}

// Two triangles have five edges, one bend spring across the middle one and no shear springs.
TEST(MeshLinks, JoinEdgesAndOppositeCornersOfTriangles) {
  const Mesh mesh = makeMesh(
      triangles({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}}, {Triangle{0, 1, 2}, Triangle{1, 3, 2}}));
  EXPECT_EQ(ends(mesh.links), (std::vector<Link>{{0, 1, SpringKind::structural},
                                                 {0, 2, SpringKind::structural},
                                                 {0, 3, SpringKind::bend},
                                                 {1, 2, SpringKind::structural},
                                                 {1, 3, SpringKind::structural},
                                                 {2, 3, SpringKind::structural}}));
  EXPECT_FLOAT_EQ(mesh.links[2].restLength, std::sqrt(3.0f));
}

// A quad 0 1 2 3 and a triangle 1 4 2 share the edge 1-2. Bend springs join corner 4 to both corners of the
// quad that are not on the edge.
TEST(MeshLinks, CrossAnEdgeBetweenQuadAndTriangle) {
  MeshShape shape = triangles({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {2, 0.5f, 0}},
                              {Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{1, 4, 2}});
  shape.quads = {0};
  std::vector<Link> bends;
  for (const Link& link : ends(makeMesh(shape).links))
    if (std::get<2>(link) == SpringKind::bend) bends.push_back(link);
  EXPECT_EQ(bends, (std::vector<Link>{{0, 4, SpringKind::bend}, {3, 4, SpringKind::bend}}));
}

// In a tetrahedron without base, opposite corners are already neighbours.
TEST(MeshLinks, JoinTwoNodesAtMostOnce) {
  const Mesh mesh = makeMesh(triangles({{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}},
                                       {Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 3, 1}}));
  EXPECT_EQ(mesh.links.size(), 6u);
}

TEST(MeshLinks, HaveTheOrderOfAGrid) {
  const std::vector<SpringLink> links = makeMesh(disc(6, 1)).links;
  const auto key = [](const SpringLink& link) { return std::tuple(link.a, link.kind, link.b); };
  EXPECT_TRUE(std::ranges::is_sorted(links, {}, key));
  // Euler's formula for the edges of a disc: nodes + triangles - 1.
  const MeshShape shape = disc(6, 1);
  EXPECT_EQ(std::ranges::count(links, SpringKind::structural, &SpringLink::kind),
            static_cast<std::ptrdiff_t>(shape.positions.size() + shape.triangles.size() - 1));
}

TEST(MeshMasses, FollowTheAreaAndAddUpToTheMass) {
  Cloth cloth = grid(2, 2);
  cloth.mesh = std::make_shared<const Mesh>(makeMesh(disc(20, 0.5f)));
  EXPECT_NEAR(cloth.mesh->area, std::numbers::pi * 0.25, 0.002);
  double sum = 0;
  for (const double mass : nodeMasses(cloth)) sum += mass;
  EXPECT_NEAR(sum, 1.5, 1e-6);
  // Inner nodes have six triangles, border nodes three or four.
  EXPECT_GT(nodeMasses(cloth).front(), 1.4 * nodeMasses(cloth).back());
}

TEST(MeshStability, EqualsThatOfTheSameGrid) {
  Cloth cloth = grid(7, 6);
  cloth.structural = {900, 0.1f};
  cloth.shear = {700, 0};
  cloth.bend = {300, 0};
  cloth.drag = 1;
  cloth.pins = {{.firstRow = 2, .lastRow = 4, .firstColumn = 2, .lastColumn = 3}};
  Scene scene;
  for (scene.simulationRate = 20; scene.simulationRate < 400; scene.simulationRate += 60) {
    scene.cloths = {cloth};
    const std::uint32_t expected = stableSubsteps(scene);
    scene.cloths = {asMesh(cloth)};
    EXPECT_EQ(stableSubsteps(scene), expected) << scene.simulationRate;
  }
}

// Light nodes need short steps.
TEST(MeshStability, FollowsTheNodeWithTheStiffestSpringsPerMass) {
  Cloth cloth = grid(2, 2);
  cloth.structural.stiffness = 1000;
  cloth.mesh = std::make_shared<const Mesh>(makeMesh(disc(8, 0.5f)));
  Scene scene;
  scene.environment.airDensity = 0;
  scene.cloths = {cloth};
  double worst = 0;
  std::vector<double> sums(cloth.nodeCount(), 0);
  for (const SpringLink& link : springLinks(cloth))
    if (link.kind == SpringKind::structural) ++sums[link.a], ++sums[link.b];
  const std::vector<double> masses = nodeMasses(cloth);
  for (std::size_t i = 0; i < sums.size(); ++i) worst = std::max(worst, sums[i] / masses[i]);
  const double step = std::sqrt(4 / (2 * 1000 * worst));
  EXPECT_EQ(stableSubsteps(scene), static_cast<std::uint32_t>(std::floor(1 / (72 * step))) + 1);
}

TEST(MeshPins, AreTheNamedNodes) {
  Cloth cloth = asMesh(grid(3, 3));
  cloth.pinnedVertices = {4, 8};
  EXPECT_EQ(pinnedNodes(cloth), (std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 1}));
}

}  // namespace
}  // namespace clothstream::model
