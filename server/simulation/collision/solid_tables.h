// SPDX-License-Identifier: MIT
// Triangle meshes of colliders as the kernels read them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/collision/solid.h"

namespace clothstream::simulation {

struct SolidTables {
  std::vector<model::Solid> solids;   // one for each mesh, in the order of the first colliders that have it
  std::vector<std::uint32_t> places;  // texel of the SolidRecord of each mesh
  std::vector<std::uint32_t> leafCounts;
  std::vector<shared::vec4> texels;  // records, triangles, vertices and boxes
  // In the tick that is recorded, m: the radius of a sphere around the collider's origin that contains the
  // mesh, and a bound on the moves of its vertices, seen from the collider.
  std::vector<float> reaches, motions;

  bool empty() const { return solids.empty(); }
  // Constants of the kernels that include distance_grid.glsl.
  std::vector<std::uint32_t> specialisation() const {
    const auto hasGrid = [](const model::Solid& solid) { return solid->distanceCell > 0; };
    return {std::ranges::any_of(solids, hasGrid), !std::ranges::all_of(solids, hasGrid)};
  }
  // Index of a mesh that the tables have.
  std::size_t indexOf(const model::Solid& solid) const;
  // Texel of the first vertex of a mesh.
  std::uint32_t firstVertexOf(std::size_t index) const {
    return places[index] + CLOTHSTREAM_SOLID_TEXELS +
           CLOTHSTREAM_TRIANGLE_TEXELS * static_cast<std::uint32_t>(solids[index]->triangles.size());
  }
};

// Takes time in proportion to the triangles and their logarithm.
SolidTables solidTables(std::span<const model::Collider> colliders);

// Tiles of `size` nodes of every cloth.
std::vector<shared::NodeTileRecord> nodeTiles(std::span<const model::Cloth> cloths, std::uint32_t size);
// The same for cloths whose first nodes are `offsets`, with the number of all nodes at its end.
std::vector<shared::NodeTileRecord> nodeTiles(std::span<const std::uint32_t> offsets, std::uint32_t size);

}  // namespace clothstream::simulation
