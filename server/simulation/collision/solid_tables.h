// SPDX-License-Identifier: MIT
// Triangle meshes of colliders as the kernels read them.
#pragma once

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
  std::vector<shared::vec4> texels;   // records, triangles, vertices and boxes

  bool empty() const { return solids.empty(); }
  // Texel of the record of a mesh that the tables have.
  std::uint32_t placeOf(const model::Solid& solid) const;
};

// Takes time in proportion to the triangles and their logarithm.
SolidTables solidTables(std::span<const model::Collider> colliders);

// Tiles of `size` nodes of every cloth.
std::vector<shared::NodeTileRecord> nodeTiles(std::span<const model::Cloth> cloths, std::uint32_t size);

}  // namespace clothstream::simulation
