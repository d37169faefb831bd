// SPDX-License-Identifier: MIT
#include "server/simulation/coarse/coarse_tables.h"

#include <algorithm>
#include <bit>

#include "server/model/coarse_level.h"

namespace clothstream::simulation {
namespace {

// Texels that one invocation sums, about.
constexpr std::size_t kTexelsPerPart = 32;
constexpr std::size_t kMaxParts = 64;

void addMeans(const model::CoarseLevel& level, std::uint32_t firstNode, CoarseTables& tables) {
  for (std::size_t k = 0; k < level.means.size(); ++k) {
    const auto& mean = level.means[k];
    const std::size_t first = tables.means.size();
    for (std::size_t i = 0; i < mean.size(); i += 2) {
      const auto at = [&](std::size_t j) -> shared::CoarseShare {
        if (j == mean.size()) return {static_cast<float>(firstNode + mean[i].node), 0};
        return {static_cast<float>(firstNode + mean[j].node), mean[j].weight};
      };
      tables.means.push_back({{at(i), at(i + 1)}});
    }
    tables.nodes.push_back({.firstLow = shared::lowHalf(first),
                            .firstHigh = shared::highHalf(first),
                            .count = static_cast<float>(tables.means.size() - first),
                            .isMovable = level.fixed[k] == 0 ? 1.0f : 0.0f});
  }
}

void addShares(const model::CoarseLevel& level, CoarseTables& tables) {
  for (const auto& four : level.shares)
    for (std::size_t i = 0; i < four.size(); i += 2)
      tables.shares.push_back({{{static_cast<float>(four[i].node), four[i].weight},
                                {static_cast<float>(four[i + 1].node), four[i + 1].weight}}});
}

// Partial sums of the mean of a mesh's coarse node.
std::uint32_t partsOf(const model::CoarseLevel& level) {
  std::size_t most = 0;
  for (const auto& mean : level.means) most = std::max(most, (mean.size() + 1) / 2);
  return static_cast<std::uint32_t>(
      std::min(kMaxParts, std::bit_ceil(std::max<std::size_t>(1, most / kTexelsPerPart))));
}

// Inverse of the number of rows or columns between the last two of them with coarse nodes.
float inverseOfLast(std::uint32_t count, std::uint32_t stride) {
  return 1 / static_cast<float>(count - 1 - (count - 2) / stride * stride);
}

void addLevel(const model::CoarseLevel& level, const model::Cloth& cloth, std::size_t number,
              std::uint32_t firstNode, CoarseTables& tables) {
  const auto size = [](const auto& table) { return static_cast<std::uint32_t>(table.size()); };
  const bool isGrid = level.lattice.stride > 0;
  shared::CoarsePush push{
      .firstNode = firstNode,
      .nodeCount = cloth.nodeCount(),
      .firstCoarse = size(tables.nodes),
      .coarseCount = size(level.means),
      .firstPart = tables.parts,
      .firstColour = size(tables.colours),
      .colourCount = size(level.colours),
      .sweeps = cloth.coarse->sweeps,
      .velocityRate = 0,
      .thickness = 0,
      .firstShare = size(tables.shares),
      .parts = isGrid ? 0 : partsOf(level),
      .rows = isGrid ? cloth.grid.rows : 0,
      .columns = isGrid ? cloth.grid.columns : 0,
      .coarseRows = level.lattice.rows,
      .coarseColumns = level.lattice.columns,
      .stride = level.lattice.stride,
      .inverseStride = isGrid ? 1 / static_cast<float>(level.lattice.stride) : 0,
      .inverseLastRows = isGrid ? inverseOfLast(cloth.grid.rows, level.lattice.stride) : 0,
      .inverseLastColumns = isGrid ? inverseOfLast(cloth.grid.columns, level.lattice.stride) : 0,
      .collision = {}};
  addMeans(level, firstNode, tables);
  if (!isGrid) addShares(level, tables);
  for (const auto& colour : level.colours) {
    const std::size_t first = tables.links.size();
    for (const model::CoarseLevel::Link& link : colour)
      tables.links.push_back(
          {static_cast<float>(link.a), static_cast<float>(link.b), link.longest, link.partOfA});
    tables.colours.push_back(shared::listRecord(first, tables.links.size()));
  }
  tables.parts += isGrid ? push.rows * push.coarseColumns : push.coarseCount * push.parts;
  tables.levels.push_back({push, number, cloth.coarse->every});
}

}  // namespace

CoarseTables coarseTables(std::span<const model::Cloth> cloths) {
  CoarseTables tables;
  std::uint32_t firstNode = 0;
  for (std::size_t i = 0; i < cloths.size(); ++i) {
    if (cloths[i].coarse)
      for (const model::CoarseLevel& level : coarseLevels(cloths[i]))
        addLevel(level, cloths[i], i, firstNode, tables);
    firstNode += cloths[i].nodeCount();
  }
  return tables;
}

}  // namespace clothstream::simulation
