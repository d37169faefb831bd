// SPDX-License-Identifier: MIT
// Vertices that become one node, and the order of nodes.
#pragma once

#include <cstdint>
#include <vector>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// For each vertex the first earlier vertex within the distance, or else itself. Cells are larger than the
// distance, so that a close vertex is usually in the same cell. The vertices of a cell are farther apart than
// the distance, so a cell has only a few, and the time is linear in the number of vertices.
std::vector<std::uint32_t> weld(const std::vector<model::Vec3>& positions, float distance);

// Nodes and the corresponding indices of the source.
struct Numbering {
  std::vector<std::uint32_t> nodeOfVertex, vertexOfNode;
};

// Numbers the vertices that faces use, along a Morton curve. `welded` is the result of weld(). Every face is
// a triangle or quad.
Numbering numberNodes(const MeshSource& source, const std::vector<model::Vec3>& placed,
                      const std::vector<std::uint32_t>& welded);

}  // namespace clothstream::meshes
