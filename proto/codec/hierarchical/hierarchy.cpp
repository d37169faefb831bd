// SPDX-License-Identifier: MIT
// Coding order of the vertices of all cloths.
#include "proto/codec/hierarchical/hierarchy.h"

#include <array>
#include <vector>

namespace clothstream::codec::hierarchical {
namespace {

CodingOrder orderOf(const ClothLayout& cloth) {
  if (!cloth.triangles.empty()) return orderMesh(cloth);
  return cloth.rows > 0 ? orderGrid(cloth.rows, cloth.columns) : orderGrid(1, cloth.vertexCount);
}

}  // namespace

bool Hierarchy::build(const StreamLayout& layout) {
  const std::uint32_t vertices = layout.vertexCount();
  std::vector<CodingOrder> orders;
  std::array<std::uint32_t, kRanks> sizes{};
  for (const ClothLayout& cloth : layout.cloths) {
    orders.push_back(orderOf(cloth));
    for (const Rank rank : orders.back().ranks) ++sizes[rank];
  }
  std::array<std::uint32_t, kRanks> next;  // next free slot
  std::vector<Phase> made;
  std::uint32_t slots = 0;
  for (Rank rank = kRanks; rank-- > 0;) {
    next[rank] = slots;
    if (sizes[rank] == 0) continue;
    made.push_back({slots, slots + sizes[rank], weightClassOf(rank)});
    slots += sizes[rank];
    if (isCoarse(rank)) {
      coarsePhases = made.size();
      coarseVertices = slots;
    }
  }
  if (!vertexOf.allocate(vertices) || !neighbours.allocate(vertices) || !nearest.allocate(vertices) ||
      !phases.allocate(made.size()))
    return false;
  std::copy(made.begin(), made.end(), phases.begin());
  std::uint32_t first = 0;
  std::vector<std::uint32_t> slotOf;
  for (const CodingOrder& order : orders) {
    slotOf.clear();
    for (const Rank rank : order.ranks) slotOf.push_back(next[rank]++);
    const auto slot = [&](std::uint32_t vertex) { return vertex == kNoVertex ? vertices : slotOf[vertex]; };
    for (std::size_t v = 0; v < slotOf.size(); ++v) {
      vertexOf[slotOf[v]] = first + static_cast<std::uint32_t>(v);
      Neighbours& to = neighbours[slotOf[v]];
      to = order.neighbours[v];
      for (std::uint32_t& parent : to.parents) parent = slot(parent);
      for (std::uint32_t& other : to.ring) other = slot(other);
      for (std::size_t i = 0; i < order.nearest[v].size(); ++i)
        nearest[slotOf[v]][i] = slot(order.nearest[v][i]);
    }
    first += static_cast<std::uint32_t>(slotOf.size());
  }
  return true;
}

void setParents(Neighbours& neighbours, std::span<const std::uint32_t> known) {
  constexpr std::uint8_t kChoice[5][4] = {
      {0, 0, 0, 0}, {0, 0, 0, 0}, {0, 1, 0, 1}, {0, 1, 0, 2}, {0, 1, 2, 3}};
  for (std::size_t i = 0; i < 4; ++i)
    neighbours.parents[i] = known.empty() ? kNoVertex : known[kChoice[known.size()][i]];
  neighbours.weights = kEqualWeights;
}

void setRing(Neighbours& neighbours, std::span<const std::uint32_t> known) {
  if (known.empty()) known = neighbours.parents;
  for (std::size_t i = 0; i < neighbours.ring.size(); ++i) neighbours.ring[i] = known[i % known.size()];
}

}  // namespace clothstream::codec::hierarchical
