// SPDX-License-Identifier: MIT
// When each vertex of one cloth is coded, and from which others it is predicted.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::size_t kWeightClasses = 6;

// Parents count as so many parts of their mean altogether.
inline constexpr int kParentBits = 6;

struct alignas(64) Neighbours {
  // Coded earlier, round the vertex; fewer are repeated. (parents[1] - parents[0]) and (parents[3] -
  // parents[2]) lie in the surface.
  std::array<std::uint32_t, 4> parents;
  // Coded earlier, farther out.
  std::array<std::uint32_t, 8> ring;
  // Of the parents in their mean, together 2^kParentBits: at rest the mean is where the vertex is, or near.
  std::array<std::int16_t, 4> weights;
};
inline constexpr std::int16_t kEqualWeight = (1 << kParentBits) / 4;
inline constexpr std::array<std::int16_t, 4> kEqualWeights{kEqualWeight, kEqualWeight, kEqualWeight,
                                                           kEqualWeight};
// Those round a vertex, coded earlier or later; the vertex itself where there is none.
using Nearest = std::array<std::uint32_t, 4>;

// What is coded together, over all cloths: higher ranks come first. A level of grids has vertices that are
// new in both directions, then those that are new in one, and meshes' levels take turns as the one or the
// other; each of these may be coded in up to kMostParts parts.
using Rank = std::uint32_t;
inline constexpr std::uint32_t kMostParts = 4, kLevels = 32, kMostCorners = 16;
constexpr Rank rankOf(std::uint32_t level, bool newInBoth, std::uint32_t part) {
  return 2 * kMostParts * level + (newInBoth ? kMostParts : 0) + kMostParts - 1 - part;
}
// Of what comes before all levels, each predicted from those before it.
constexpr Rank rankOfCorner(std::uint32_t corner) {
  return 2 * kMostParts * kLevels + kMostCorners - 1 - corner;
}
inline constexpr Rank kRanks = 2 * kMostParts * kLevels + kMostCorners;

// Which set of weights predicts them: 0 and 1 the finest level, 2 and 3 the next, 4 and 5 all that are
// coarser; of each pair the first is what is new in both directions. kWeightClasses: no weights.
constexpr std::uint32_t weightClassOf(Rank rank) {
  const std::uint32_t level = rank / (2 * kMostParts);
  if (level >= kLevels) return kWeightClasses;
  return 2 * std::min(level, 2u) + (rank % (2 * kMostParts) < kMostParts ? 1 : 0);
}
// Coarse vertices are those of levels from this one up, and corners. Nothing of a coarse vertex depends on
// one that is not.
inline constexpr std::uint32_t kCoarseLevel = 2;
constexpr bool isCoarse(Rank rank) {
  return rank / (2 * kMostParts) >= kCoarseLevel;
}

// By vertex of the cloth, which `neighbours` and `nearest` name, too; kNoVertex stands for the origin.
struct CodingOrder {
  std::vector<Rank> ranks;
  std::vector<Neighbours> neighbours;
  std::vector<Nearest> nearest;

  explicit CodingOrder(std::size_t vertices) : ranks(vertices), neighbours(vertices), nearest(vertices) {}
};
inline constexpr std::uint32_t kNoVertex = ~0u;

CodingOrder orderGrid(std::uint32_t rows, std::uint32_t columns);
CodingOrder orderMesh(const ClothLayout& cloth);

// Up to four of them, spread over parents[]; none is the origin. Their weights are equal.
void setParents(Neighbours& neighbours, std::span<const std::uint32_t> known);
// Up to eight of them, over and over; where there is none: the parents.
void setRing(Neighbours& neighbours, std::span<const std::uint32_t> known);

}  // namespace clothstream::codec::hierarchical
