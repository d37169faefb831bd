// SPDX-License-Identifier: MIT
// Tree of boxes over the triangles of a mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/closed_mesh.h"

namespace clothstream::simulation {

// Complete binary tree in the order of a heap: the root is node 1, and node i has the children 2 i and
// 2 i + 1. Leaf l is node leafCount + l. It has the triangles order[firstOf(l)] to order[firstOf(l + 1) - 1].
struct TriangleTree {
  struct Box {
    model::Vec3 low, high;
  };

  std::uint32_t leafCount = 1;       // a power of two
  std::vector<std::uint32_t> order;  // triangles of the mesh
  std::vector<Box> boxes;            // of the nodes; the first is unused

  std::size_t firstOf(std::size_t leaf) const { return leaf * order.size() / leafCount; }
};

// Triangles of a leaf: at most this many.
inline constexpr std::uint32_t kLeafTriangles = 4;

// Splits the triangles at the median of their centres, along the longest side of the box of the centres. The
// result is the same on every machine.
TriangleTree makeTriangleTree(std::span<const model::Vec3> vertices,
                              std::span<const model::TriangleCorners> triangles);

}  // namespace clothstream::simulation
