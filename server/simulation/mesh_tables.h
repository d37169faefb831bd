// SPDX-License-Identifier: MIT
// Tables of the meshes of a scene.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/mesh.h"
#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/shared/mesh.h"

namespace clothstream::simulation {

struct MeshTables {
  MeshTiles tiles;                            // one per workgroup
  std::vector<shared::MeshNodeRecord> nodes;  // of all meshes
  std::vector<shared::SpringPairRecord> springEnds;
  std::vector<shared::CornerPairRecord> corners;
};

// Appends, in the order of the triangles, those of each node to `pairs`, and sets MeshNodeRecord::triangles.
void appendCorners(const model::Mesh& mesh, std::uint32_t firstNode, std::span<shared::MeshNodeRecord> nodes,
                   std::vector<shared::CornerPairRecord>& pairs);

// Tiles of the meshes; part of meshTables().
MeshTiles meshTiles(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize);

// Empty if no cloth is a mesh.
MeshTables meshTables(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize);

}  // namespace clothstream::simulation
