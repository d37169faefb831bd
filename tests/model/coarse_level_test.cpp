// SPDX-License-Identifier: MIT
// Means of a cloth's nodes, and the pairs of them that are never farther apart than at rest.
#include "server/model/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "server/model/mesh.h"
#include "tests/model/meshes.h"

namespace clothstream::tests {
namespace {

using model::CoarseLevel;

model::Cloth coarse(model::Cloth cloth, std::uint32_t cells) {
  cloth.coarse = model::CoarseCorrection{.cells = cells};
  return cloth;
}

model::Cloth meshOf(model::MeshShape shape) {
  model::Cloth cloth;
  cloth.mass = 1;
  cloth.mesh = std::make_shared<const model::Mesh>(makeMesh(std::move(shape)));
  return cloth;
}

CoarseLevel levelOf(const model::Cloth& cloth) {
  return coarseLevels(cloth).back();
}

std::size_t linkCount(const CoarseLevel& level) {
  std::size_t count = 0;
  for (const auto& colour : level.colours) count += colour.size();
  return count;
}

// Means and shares are averages, and no two links of a colour meet.
void expectConsistent(const CoarseLevel& level) {
  const auto sumOf = [](const auto& shares) {
    double sum = 0;
    for (const CoarseLevel::Share& share : shares) sum += double{share.weight};
    return sum;
  };
  ASSERT_EQ(level.means.size(), level.fixed.size());
  for (std::size_t k = 0; k < level.means.size(); ++k) {
    if (!level.means[k].empty()) {
      EXPECT_NEAR(sumOf(level.means[k]), 1, 1e-5);
    }
    if (level.fixed[k] != 0) {
      EXPECT_EQ(level.means[k].size(), 1u);
    }
  }
  for (const auto& four : level.shares) EXPECT_NEAR(sumOf(four), 1, 1e-6);
  for (const auto& colour : level.colours) {
    std::set<std::uint32_t> seen;
    for (const CoarseLevel::Link& link : colour) {
      EXPECT_TRUE(seen.insert(link.a).second);
      EXPECT_TRUE(seen.insert(link.b).second);
      EXPECT_TRUE(level.fixed[link.a] == 0 || level.fixed[link.b] == 0);
    }
  }
}

TEST(CoarseLevel, LinksRowsColumnsAndDiagonalsOfAGrid) {
  const CoarseLevel level = levelOf(coarse(model::grid(17, 9), 4));
  expectConsistent(level);
  EXPECT_EQ(level.lattice.rows, 5u);
  EXPECT_EQ(level.lattice.columns, 3u);
  EXPECT_EQ(level.lattice.stride, 4u);
  // 5 rows of 2 links, 4 rows of 3 links, and two diagonals of 4 x 2 cells.
  EXPECT_EQ(linkCount(level), 10u + 12u + 16u);
}

// The grid is 3 m wide and 2 m high. The mean of an inner coarse node is its place, that of a border is moved
// inwards.
TEST(CoarseLevel, LinksAreAsLongAsTheMeansAreApartAtRest) {
  const CoarseLevel level = levelOf(coarse(model::grid(17, 17), 4));
  const auto longest = [&](std::uint32_t a, std::uint32_t b) {
    for (const auto& colour : level.colours)
      for (const CoarseLevel::Link& link : colour)
        if (std::set{link.a, link.b} == std::set{a, b}) return link.longest;
    ADD_FAILURE() << "no link from " << a << " to " << b;
    return 0.0f;
  };
  EXPECT_NEAR(longest(6, 7), 3.0 / 4, 1e-6);
  EXPECT_NEAR(longest(6, 11), 2.0 / 4, 1e-6);
  EXPECT_NEAR(longest(6, 12), std::hypot(3.0 / 4, 2.0 / 4), 1e-6);
  // Weights 1, 3/4, 1/2 and 1/4: the mean of a border is one column inwards.
  EXPECT_NEAR(longest(5, 6), 3.0 / 4 - 3.0 / 16, 1e-6);
}

// Corners have a quarter of the mass of inner coarse nodes, borders a half, up to the borders' own rows.
TEST(CoarseLevel, LighterEndsOfALinkTakeMoreOfACorrection) {
  const CoarseLevel level = levelOf(coarse(model::grid(33, 33), 4));
  for (const auto& colour : level.colours)
    for (const CoarseLevel::Link& link : colour) {
      if (link.a == 0 && link.b == 1) {
        EXPECT_NEAR(link.partOfA, 8.0 / (8.0 + 4.5), 1e-6);
      }
      if (link.a == 6 && link.b == 7) {
        EXPECT_EQ(link.partOfA, 0.5f);
      }
    }
}

TEST(CoarseLevel, APinnedNodeWithinHalfACellReplacesTheMean) {
  model::Cloth cloth = coarse(model::grid(17, 17), 4);
  cloth.pins = {{.firstRow = 1, .lastRow = 1, .firstColumn = 1, .lastColumn = 1},
                {.firstRow = 6, .lastRow = 6, .firstColumn = 6, .lastColumn = 6}};
  const CoarseLevel level = levelOf(cloth);
  expectConsistent(level);
  EXPECT_EQ(level.fixed[0], 1);
  EXPECT_EQ(level.means[0].at(0).node, 18u);
  EXPECT_EQ(std::count(level.fixed.begin(), level.fixed.end(), 1), 1);
  for (const auto& colour : level.colours)
    for (const CoarseLevel::Link& link : colour)
      if (link.a == 0) {
        EXPECT_EQ(link.partOfA, 0);
      }
}

TEST(CoarseLevel, TheFirstOfTwoHasAQuarterOfTheCells) {
  model::Cloth cloth = coarse(model::grid(65, 65), 16);
  EXPECT_EQ(coarseLevels(cloth).size(), 1u);
  cloth.coarse->levels = 2;
  const std::vector<CoarseLevel> levels = coarseLevels(cloth);
  ASSERT_EQ(levels.size(), 2u);
  EXPECT_EQ(levels[0].lattice.rows, 5u);
  EXPECT_EQ(levels[1].lattice.rows, 17u);
}

TEST(CoarseLevel, EveryShapeOfGridHasOne) {
  for (const auto& [rows, columns] :
       {std::pair{2u, 2u}, {2u, 40u}, {3u, 3u}, {5u, 100u}, {18u, 18u}, {200u, 7u}})
    for (const std::uint32_t cells : {2u, 5u, 16u}) {
      SCOPED_TRACE(::testing::Message() << rows << " x " << columns << ", " << cells);
      const CoarseLevel level = levelOf(coarse(model::grid(rows, columns), cells));
      expectConsistent(level);
      EXPECT_LE(level.means.size(), model::kMaxCoarseNodes);
    }
}

TEST(CoarseLevel, CoversAllNodesOfAMesh) {
  const model::Cloth cloth = coarse(meshOf(model::disc(12, 1)), 6);
  const CoarseLevel level = levelOf(cloth);
  expectConsistent(level);
  EXPECT_EQ(level.means.size(), 49u);
  EXPECT_EQ(level.shares.size(), cloth.nodeCount());
  // Each centre has about six neighbours.
  EXPECT_GT(linkCount(level), 2 * level.means.size());
  EXPECT_LT(linkCount(level), 4 * level.means.size());
}

// A strip bent to half a cylinder may unfold: its means may be as far apart as the cloth between them is
// long.
TEST(CoarseLevel, CurvedMeshesMayUnfold) {
  const auto strip = [](bool bent) {
    model::MeshShape shape = shapeOf(model::grid(41, 5));
    for (int row = 0; row < 41; ++row)
      for (int column = 0; column < 5; ++column) {
        const double angle = std::numbers::pi * row / 40;
        const double across = 0.05 * column;
        shape.positions[static_cast<std::size_t>(row * 5 + column)] =
            (bent ? Eigen::Vector3d(across, std::sin(angle), std::cos(angle))
                  : Eigen::Vector3d(across, 0, angle))
                .cast<float>();
      }
    return levelOf(coarse(meshOf(std::move(shape)), 2));
  };
  const auto totalOf = [](const CoarseLevel& level) {
    double total = 0;
    for (const auto& colour : level.colours)
      for (const CoarseLevel::Link& link : colour) total += double{link.longest};
    return total;
  };
  const CoarseLevel bent = strip(true), flat = strip(false);
  expectConsistent(bent);
  ASSERT_EQ(linkCount(bent), linkCount(flat));
  EXPECT_NEAR(totalOf(bent), totalOf(flat), 0.05 * totalOf(flat));
}

TEST(CoarseLevel, SeparatePiecesOfAMeshAreNotLinked) {
  model::MeshShape shape = shapeOf(model::grid(9, 9));
  const auto nodes = static_cast<std::uint32_t>(shape.positions.size());
  const model::MeshShape one = shape;
  for (const model::Vec3& place : one.positions) shape.positions.push_back(place + model::Vec3(0, 0, 1));
  for (model::Triangle triangle : one.triangles) {
    for (std::uint32_t& node : triangle) node += nodes;
    shape.triangles.push_back(triangle);
  }
  for (const std::uint32_t quad : one.quads)
    shape.quads.push_back(quad + static_cast<std::uint32_t>(one.triangles.size()));
  shape.submeshes[0].triangleCount *= 2;
  const CoarseLevel level = levelOf(coarse(meshOf(std::move(shape)), 4));
  expectConsistent(level);
  const auto pieceOf = [&](std::uint32_t k) { return level.means[k].at(0).node < nodes; };
  for (const auto& colour : level.colours)
    for (const CoarseLevel::Link& link : colour) EXPECT_EQ(pieceOf(link.a), pieceOf(link.b));
}

}  // namespace
}  // namespace clothstream::tests
