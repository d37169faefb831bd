// SPDX-License-Identifier: MIT
// Distances along a cloth to its fixed nodes.
#include "server/model/tethers.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/model/meshes.h"

namespace clothstream::tests {
namespace {

using model::NodeTethers;
using model::Tether;

constexpr float kSpacing = 0.1f;

model::Cloth grid(std::uint32_t rows, std::uint32_t columns) {
  model::Cloth cloth;
  cloth.grid = {.rows = rows,
                .columns = columns,
                .width = kSpacing * static_cast<float>(columns - 1),
                .height = kSpacing * static_cast<float>(rows - 1),
                .pose = {}};
  cloth.mass = 1;
  return cloth;
}

// Distance along rows, columns and diagonals.
double way(std::uint32_t rows, std::uint32_t columns) {
  const std::uint32_t both = std::min(rows, columns), rest = std::max(rows, columns) - both;
  return double{kSpacing} * (both * std::sqrt(2) + rest);
}

TEST(Tethers, LeadFromEachNodeToTheNearestOfTwoCorners) {
  model::Cloth cloth = grid(5, 7);
  cloth.pins = {{}, {.firstColumn = 6, .lastColumn = 6}};
  const std::vector<NodeTethers> tethers = nodeTethers(cloth);
  ASSERT_EQ(tethers.size(), 35u);
  for (std::uint32_t row = 0; row < 5; ++row)
    for (std::uint32_t column = 0; column < 7; ++column) {
      const NodeTethers& of = tethers[row * 7 + column];
      if (row == 0 && (column == 0 || column == 6)) {
        EXPECT_EQ(of[0].anchor, Tether::kNone);
        continue;
      }
      const double left = way(row, column), right = way(row, 6 - column);
      EXPECT_NEAR(of[0].length, std::min(left, right), 1e-6);
      EXPECT_NEAR(of[1].length, std::max(left, right), 1e-6);
      if (left != right) {
        EXPECT_EQ(of[0].anchor, left < right ? 0u : 6u);
        EXPECT_EQ(of[1].anchor, left < right ? 6u : 0u);
      }
    }
}

TEST(Tethers, LeadToOneNodeOfEachGroup) {
  model::Cloth cloth = grid(4, 6);
  model::Attachment rod;
  rod.ranges = {{.lastColumn = 5}};
  cloth.attachments = {rod};
  for (const NodeTethers& of : nodeTethers(cloth)) EXPECT_EQ(of[1].anchor, Tether::kNone);
  // The path is straight up to the rod.
  EXPECT_EQ(nodeTethers(cloth)[3 * 6 + 2][0].anchor, 2u);
  EXPECT_NEAR(nodeTethers(cloth)[3 * 6 + 2][0].length, 3 * kSpacing, 1e-6);
  cloth.pinnedVertices = {3 * 6 + 5};
  EXPECT_EQ(nodeTethers(cloth)[2 * 6 + 5][0].anchor, 3u * 6 + 5);
  EXPECT_EQ(nodeTethers(cloth)[2 * 6 + 5][1].anchor, 5u);
}

TEST(Tethers, AreAbsentWithoutFixedNodes) {
  for (const NodeTethers& of : nodeTethers(grid(3, 3))) {
    EXPECT_EQ(of[0].anchor, Tether::kNone);
    EXPECT_EQ(of[1].anchor, Tether::kNone);
  }
}

TEST(Tethers, EqualThoseOfTheSameGridForMeshes) {
  model::Cloth cloth = grid(6, 5);
  cloth.pins = {{}, {.firstColumn = 4, .lastColumn = 4}};
  const model::Cloth mesh = model::asMesh(cloth);
  const std::vector<NodeTethers> expected = nodeTethers(cloth), tethers = nodeTethers(mesh);
  ASSERT_EQ(tethers.size(), expected.size());
  for (std::size_t i = 0; i < tethers.size(); ++i)
    for (const std::size_t k : {0u, 1u}) {
      EXPECT_EQ(tethers[i][k].anchor, expected[i][k].anchor);
      EXPECT_NEAR(tethers[i][k].length, expected[i][k].length, 1e-5);
    }
}

}  // namespace
}  // namespace clothstream::tests
