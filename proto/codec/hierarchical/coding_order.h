// SPDX-License-Identifier: MIT
// Coding order of the vertices of one cloth, and the neighbours that each is predicted from.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::size_t kWeightClasses = 6;

// Bits of the parents' weights: the weights of a vertex add up to 2^kParentBits.
inline constexpr int kParentBits = 6;

struct alignas(64) Neighbours {
  // Vertices around this one that are coded earlier; fewer than four are repeated. (parents[1] - parents[0])
  // and (parents[3] - parents[2]) lie in the surface.
  std::array<std::uint32_t, 4> parents;
  // Vertices farther out that are coded earlier.
  std::array<std::uint32_t, 8> ring;
  // Weights of the parents in their mean; they add up to 2^kParentBits. At rest the mean is at the vertex or
  // near it.
  std::array<std::int16_t, 4> weights;
};
inline constexpr std::int16_t kEqualWeight = (1 << kParentBits) / 4;
inline constexpr std::array<std::int16_t, 4> kEqualWeights{kEqualWeight, kEqualWeight, kEqualWeight,
                                                           kEqualWeight};
// Vertices around this one, coded earlier or later. The vertex itself replaces a missing one.
using Nearest = std::array<std::uint32_t, 4>;

// Vertices of one rank are coded together, over all cloths; higher ranks come first. A level of a grid has
// vertices that are new in both directions, then vertices that are new in one. The levels of a mesh alternate
// between the two. Each of these may be coded in up to kMaxParts parts.
using Rank = std::uint32_t;
inline constexpr std::uint32_t kMaxParts = 4, kLevels = 32, kMaxCorners = 16;
constexpr Rank rankOf(std::uint32_t level, bool newInBoth, std::uint32_t part) {
  return 2 * kMaxParts * level + (newInBoth ? kMaxParts : 0) + kMaxParts - 1 - part;
}
// Rank of a corner. Corners come before all levels, and each is predicted from the corners before it.
constexpr Rank rankOfCorner(std::uint32_t corner) {
  return 2 * kMaxParts * kLevels + kMaxCorners - 1 - corner;
}
inline constexpr Rank kRanks = 2 * kMaxParts * kLevels + kMaxCorners;

// Set of weights that predicts the vertices of a rank: 0 and 1 for the finest level, 2 and 3 for the next, 4
// and 5 for all coarser ones. The first of each pair is for vertices that are new in both directions.
// kWeightClasses means no weights.
constexpr std::uint32_t weightClassOf(Rank rank) {
  const std::uint32_t level = rank / (2 * kMaxParts);
  if (level >= kLevels) return kWeightClasses;
  return 2 * std::min(level, 2u) + (rank % (2 * kMaxParts) < kMaxParts ? 1 : 0);
}
// Coarse vertices are the corners and the vertices of levels from this one up. Nothing of a coarse vertex
// depends on a vertex that is not coarse.
inline constexpr std::uint32_t kCoarseLevel = 2;
constexpr bool isCoarse(Rank rank) {
  return rank / (2 * kMaxParts) >= kCoarseLevel;
}

// Indexed by vertex of the cloth. `neighbours` and `nearest` name vertices of the cloth too; kNoVertex is the
// origin.
struct CodingOrder {
  std::vector<Rank> ranks;
  std::vector<Neighbours> neighbours;
  std::vector<Nearest> nearest;

  explicit CodingOrder(std::size_t vertices) : ranks(vertices), neighbours(vertices), nearest(vertices) {}
};
inline constexpr std::uint32_t kNoVertex = ~0u;

CodingOrder orderGrid(std::uint32_t rows, std::uint32_t columns);
CodingOrder orderMesh(const ClothLayout& cloth);

// Spreads at most four known vertices over parents[] and sets equal weights. Without any, all parents are the
// origin.
void setParents(Neighbours& neighbours, std::span<const std::uint32_t> known);
// Repeats at most eight known vertices over ring[]. Without any, takes the parents.
void setRing(Neighbours& neighbours, std::span<const std::uint32_t> known);

}  // namespace clothstream::codec::hierarchical
