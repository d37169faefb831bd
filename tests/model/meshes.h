// SPDX-License-Identifier: MIT
// Meshes shared by tests.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>

#include "server/model/mesh.h"
#include "server/model/scene.h"

namespace clothstream::model {

// Grid of rows x columns nodes, 3 x 2 m, 1.5 kg.
inline Cloth grid(std::uint32_t rows, std::uint32_t columns) {
  Cloth cloth;
  cloth.grid = {.rows = rows, .columns = columns, .width = 3, .height = 2, .pose = {}};
  cloth.mass = 1.5f;
  return cloth;
}

// Nodes, triangles and quads of the grid.
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

// The grid as a mesh, with the even masses of a grid and the same pinned nodes.
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

// Disc of `rings` rings around its centre in the XZ plane. Ring k has 6 k nodes. The mesh is irregular:
// almost every node has different surroundings from its neighbours.
MeshShape disc(std::uint32_t rings, float radius);

// Sphere around the origin: an icosahedron whose faces are divided into `parts` times `parts` triangles. It
// has 10 parts^2 + 2 nodes, with fronts outside.
MeshShape icosphere(std::uint32_t parts, float radius);

// Cube of 8 nodes and 12 triangles around `centre`, with fronts outside.
MeshShape cube(float edge, const Vec3& centre = Vec3::Zero());

}  // namespace clothstream::model
