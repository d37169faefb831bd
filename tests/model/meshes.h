// SPDX-License-Identifier: MIT
// Meshes that several tests start from.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/model/mesh.h"
#include "server/model/scene.h"

namespace clothstream::model {

// rows x columns nodes of a rectangle of 3 x 2 m and 1.5 kg.
inline Cloth grid(std::uint32_t rows, std::uint32_t columns) {
  Cloth cloth;
  cloth.grid = {.rows = rows, .columns = columns, .width = 3, .height = 2, .pose = {}};
  cloth.mass = 1.5f;
  return cloth;
}

// The grid's nodes, triangles and quads.
inline MeshShape shapeOf(const Cloth& grid) {
  MeshShape shape{.positions = restPositions(grid.grid),
                  .triangles = clothTriangles(grid),
                  .quads = {},
                  .uvs = {},
                  .uvTriangles = {},
                  .submeshes = {}};
  for (std::uint32_t t = 0; t < shape.triangles.size(); t += 2) shape.quads.push_back(t);
  shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
  return shape;
}

// The same cloth as a mesh, its mass spread evenly as a grid's is; the same nodes are pinned.
inline Cloth asMesh(const Cloth& grid) {
  Cloth cloth = grid;
  Mesh mesh = makeMesh(shapeOf(grid));
  std::ranges::fill(mesh.shares, 1.0 / mesh.nodeCount());
  const std::vector<std::uint8_t> pinned = pinnedNodes(grid);
  for (std::uint32_t node = 0; node < pinned.size(); ++node)
    if (pinned[node] != 0) cloth.pinnedVertices.push_back(node);
  cloth.pins.clear();
  cloth.mesh = std::make_shared<const Mesh>(std::move(mesh));
  return cloth;
}

// A disc of `rings` rings round its centre, the k-th of 6 k nodes, in the XZ plane: as good as no node sees
// what its neighbour sees.
MeshShape disc(std::uint32_t rings, float radius);

}  // namespace clothstream::model
