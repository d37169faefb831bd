// SPDX-License-Identifier: MIT
#include "server/meshes/numbering.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <unordered_map>

namespace clothstream::meshes {
namespace {

using model::Vec3;

// Cell of the grid that finds close vertices.
struct Cell {
  std::int64_t x, y, z;
  bool operator==(const Cell&) const = default;
};

// Seeded at random, so that no mesh can be made whose cells have equal hashes.
class CellHash {
 public:
  CellHash() {
    std::random_device random;
    seed_ = std::uint64_t{random()} << 32 | random();
  }
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = seed_;
    for (const std::int64_t part : {cell.x, cell.y, cell.z})
      hash = mixed(hash ^ static_cast<std::uint64_t>(part));
    return hash;
  }

 private:
  // Finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
  static std::uint64_t mixed(std::uint64_t value) {
    value += 0x9E3779B97F4A7C15;
    value = (value ^ value >> 30) * 0xBF58476D1CE4E5B9;
    value = (value ^ value >> 27) * 0x94D049BB133111EB;
    return value ^ value >> 31;
  }

  std::uint64_t seed_;
};

// Minimum size of a cell in metres. It keeps cell indices within 64 bits.
constexpr double kSmallestCell = 1e-9;

// Spreads 21 bits to every third bit.
std::uint64_t spread(std::uint64_t x) {
  x &= (1u << 21) - 1;
  x = (x | x << 32) & 0x001F00000000FFFFull;
  x = (x | x << 16) & 0x001F0000FF0000FFull;
  x = (x | x << 8) & 0x100F00F00F00F00Full;
  x = (x | x << 4) & 0x10C30C30C30C30C3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

// Order along a Morton curve through the bounding cube. It depends on positions only, so ordering twice
// changes nothing. Vertices in the same cell of the curve keep their order.
std::vector<std::uint32_t> curveOrder(const std::vector<Vec3>& positions, std::vector<std::uint32_t> nodes) {
  Vec3 low = positions[nodes.front()], high = low;
  for (const std::uint32_t i : nodes) {
    low = low.cwiseMin(positions[i]);
    high = high.cwiseMax(positions[i]);
  }
  const double cells = ((1 << 21) - 1) / std::max(1e-30, double{(high - low).maxCoeff()});
  std::vector<std::uint64_t> keys(positions.size(), 0);
  for (const std::uint32_t i : nodes) {
    const auto along = [&](int axis) {
      return spread(static_cast<std::uint64_t>((double{positions[i][axis]} - double{low[axis]}) * cells));
    };
    keys[i] = along(0) | along(1) << 1 | along(2) << 2;
  }
  std::ranges::stable_sort(nodes, {}, [&](std::uint32_t i) { return keys[i]; });
  return nodes;
}

}  // namespace

std::vector<std::uint32_t> weld(const std::vector<Vec3>& positions, float distance) {
  std::vector<std::uint32_t> first(positions.size());
  std::iota(first.begin(), first.end(), 0u);
  if (distance <= 0) return first;
  const double reach = distance, cell = std::max(2 * reach, kSmallestCell);
  const auto cellOf = [&](double coordinate) {
    return static_cast<std::int64_t>(std::floor(coordinate / cell));
  };
  std::unordered_multimap<Cell, std::uint32_t, CellHash> cells;
  cells.reserve(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    const Eigen::Vector3d p = positions[i].cast<double>();
    std::uint32_t nearest = i;
    for (std::int64_t x = cellOf(p.x() - reach); x <= cellOf(p.x() + reach); ++x)
      for (std::int64_t y = cellOf(p.y() - reach); y <= cellOf(p.y() + reach); ++y)
        for (std::int64_t z = cellOf(p.z() - reach); z <= cellOf(p.z() + reach); ++z) {
          const auto [begin, end] = cells.equal_range({x, y, z});
          for (auto it = begin; it != end; ++it)
            if ((positions[it->second] - positions[i]).norm() <= distance)
              nearest = std::min(nearest, it->second);
        }
    first[i] = nearest;
    if (nearest == i) cells.emplace(Cell{cellOf(p.x()), cellOf(p.y()), cellOf(p.z())}, i);
  }
  return first;
}

Numbering numberNodes(const MeshSource& source, const std::vector<Vec3>& placed,
                      const std::vector<std::uint32_t>& welded) {
  std::vector<std::uint32_t> used;
  std::vector<bool> isUsed(placed.size(), false);
  for (const SourceFace& face : source.faces)
    for (std::uint32_t corner = 0; corner < face.cornerCount; ++corner)
      isUsed[welded[face.vertices[corner]]] = true;
  for (std::uint32_t i = 0; i < placed.size(); ++i)
    if (isUsed[i]) used.push_back(i);
  Numbering numbering{std::vector<std::uint32_t>(placed.size(), kNoNode), curveOrder(placed, used)};
  for (std::uint32_t node = 0; node < numbering.vertexOfNode.size(); ++node)
    numbering.nodeOfVertex[numbering.vertexOfNode[node]] = node;
  for (std::uint32_t i = 0; i < placed.size(); ++i)
    numbering.nodeOfVertex[i] = numbering.nodeOfVertex[welded[i]];
  return numbering;
}

}  // namespace clothstream::meshes
