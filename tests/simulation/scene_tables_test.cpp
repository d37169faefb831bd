// SPDX-License-Identifier: MIT
// The tables that kernels read: every node is somebody's, once.
#include "server/simulation/scene_tables.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

// What locateStrip() does with a tile, for each of its invocations.
std::vector<int> visitsOf(const std::vector<model::Cloth>& cloths, std::uint32_t rowsPerInvocation,
                          std::uint32_t workgroupSize) {
  const std::vector<std::uint32_t> offsets = simulation::clothOffsets(cloths);
  std::vector<int> visits(offsets.back());
  for (const shared::TileRecord& tile :
       simulation::makeTiles(cloths, rowsPerInvocation, workgroupSize).records)
    for (std::uint32_t lane = 0; lane < workgroupSize; ++lane) {
      const auto cloth = static_cast<std::uint32_t>(tile.cloth);
      const model::Grid& grid = cloths[cloth].grid;
      const std::uint32_t along = static_cast<std::uint32_t>(tile.column) + lane;
      const std::uint32_t row =
          static_cast<std::uint32_t>(tile.row) + along / grid.columns * rowsPerInvocation;
      for (std::uint32_t r = row; r < std::min(row + rowsPerInvocation, grid.rows); ++r)
        ++visits[offsets[cloth] + r * grid.columns + along % grid.columns];
    }
  return visits;
}

TEST(SceneTables, TilesCoverEveryNodeOnce) {
  const std::vector<model::Cloth> cloths{calmCloth(2, 2), calmCloth(3, 65), calmCloth(65, 3),
                                         calmCloth(64, 64), calmCloth(17, 130)};
  for (const std::uint32_t rows : {1u, 3u, 8u, 32u})
    for (const std::uint32_t workgroup : {8u, 64u, 100u})
      EXPECT_THAT(visitsOf(cloths, rows, workgroup), ::testing::Each(1)) << rows << " rows, " << workgroup;
}

TEST(SceneTables, PinnedNodesHaveNoInverseMass) {
  model::Cloth cloth = calmCloth(3, 4);
  cloth.pins = {topRow(cloth)};
  const std::vector<float> masses = simulation::inverseMasses(std::vector{cloth, calmCloth(2, 2)});
  ASSERT_EQ(masses.size(), 16u);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(masses[i], 0);
  for (std::size_t i = 4; i < 16; ++i) EXPECT_NEAR(masses[i], 100, 1e-4);
}

TEST(SceneTables, FirstNodesOfLargeScenesAreExact) {
  const std::vector<model::Cloth> cloths{calmCloth(5000, 5003), calmCloth(2, 2)};
  const shared::ClothRecord record = simulation::clothRecords(cloths, 0.001).back();
  EXPECT_EQ(shared::wholeNumber(record.firstNodeLow, record.firstNodeHigh), 5000u * 5003u);
}

}  // namespace
}  // namespace clothstream::tests
