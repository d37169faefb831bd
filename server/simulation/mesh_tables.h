// SPDX-License-Identifier: MIT
// The meshes of a scene as the kernels read them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/shared/mesh.h"

namespace clothstream::simulation {

struct MeshTables {
  // One a workgroup: cloth, first node in the cloth, its number among the nodes of all meshes.
  Tiles tiles;
  std::vector<shared::MeshNodeRecord> nodes;  // of all meshes
  std::vector<shared::SpringPairRecord> springEnds;
  std::vector<shared::CornerPairRecord> corners;
};

// Of the meshes; MeshTables has them.
Tiles meshTiles(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize);

// Empty where no cloth is a mesh.
MeshTables meshTables(std::span<const model::Cloth> cloths, std::uint32_t workgroupSize);

}  // namespace clothstream::simulation
