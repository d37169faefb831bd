// SPDX-License-Identifier: MIT
// Rest positions, pins, spacing and motion.
#include "server/model/scene.h"

#include <cmath>

#include <gtest/gtest.h>

namespace clothstream::model {
namespace {

TEST(RestPositions, HangInTheXyPlaneWithRowsDownFromZero) {
  const std::vector<Vec3> positions = restPositions({.rows = 3, .columns = 5, .width = 4, .height = 1});
  ASSERT_EQ(positions.size(), 15u);
  EXPECT_EQ(positions[0], Vec3(-2, 0, 0));
  EXPECT_EQ(positions[4], Vec3(2, 0, 0));
  EXPECT_EQ(positions[7], Vec3(0, -0.5f, 0));
  EXPECT_EQ(positions[14], Vec3(2, -1, 0));
}

TEST(RestPositions, AreRotatedThenTranslatedByThePose) {
  Grid grid{.rows = 2, .columns = 2, .width = 2, .height = 3};
  const float half = std::sqrt(0.5f);
  grid.pose = {Vec3(10, 20, 30), Quaternion(half, half, 0, 0)};  // a quarter turn about +X takes -Y to -Z
  const std::vector<Vec3> positions = restPositions(grid);
  EXPECT_LT((positions[0] - Vec3(9, 20, 30)).norm(), 1e-5f);  // a few ulp of 30
  EXPECT_LT((positions[3] - Vec3(11, 20, 27)).norm(), 1e-5f);
}

TEST(Spacing, EqualsDistancesOfRestPositions) {
  const GridSpacing lengths = spacing({.rows = 4, .columns = 5, .width = 12, .height = 12});
  EXPECT_EQ(lengths.column, 3);
  EXPECT_EQ(lengths.row, 4);
  EXPECT_EQ(lengths.diagonal, 5);
}

TEST(PinnedNodes, FollowRangesWithSteps) {
  Cloth cloth;
  cloth.grid = {.rows = 4, .columns = 7};
  cloth.pins = {{.firstRow = 0, .lastRow = 0, .firstColumn = 0, .lastColumn = 6, .columnStep = 3},
                {.firstRow = 1, .lastRow = 3, .rowStep = 2, .firstColumn = 6, .lastColumn = 6}};
  const std::vector<std::uint8_t> expected = {1, 0, 0, 1, 0, 0, 1,  //
                                              0, 0, 0, 0, 0, 0, 1,  //
                                              0, 0, 0, 0, 0, 0, 0,  //
                                              0, 0, 0, 0, 0, 0, 1};
  EXPECT_EQ(pinnedNodes(cloth), expected);
  EXPECT_EQ(cloth.pins[0].nodeCount(), 3u);
  EXPECT_EQ(cloth.pins[1].nodeCount(), 2u);
}

TEST(PinnedNodes, AreEmptyWithoutRanges) {
  Cloth cloth;
  cloth.grid = {.rows = 3, .columns = 3};
  EXPECT_EQ(pinnedNodes(cloth), std::vector<std::uint8_t>(9, 0));
}

TEST(Scene, CountsTheNodesOfAllCloths) {
  Scene scene;
  scene.cloths.resize(2);
  scene.cloths[0].grid = {.rows = 3, .columns = 5};
  scene.cloths[1].grid = {.rows = 8192, .columns = 2};
  EXPECT_EQ(scene.nodeCount(), 15u + 16384u);
}

}  // namespace
}  // namespace clothstream::model
