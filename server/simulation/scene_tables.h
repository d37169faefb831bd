// SPDX-License-Identifier: MIT
// A scene as the kernels read it: a record a cloth, a record a workgroup.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/scene/scene.h"
#include "server/simulation/state_snapshot.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// First node of each cloth, and at the end the number of nodes: clothCount + 1 numbers.
std::vector<std::uint32_t> clothOffsets(std::span<const scene::Cloth> cloths);

std::vector<shared::ClothRecord> clothRecords(std::span<const scene::Cloth> cloths, double substepSeconds);

// The most iterations in a substep that a cloth asks for: of those with constraints, and of implicit ones.
struct SolveIterations {
  std::uint32_t constraints = 0, implicit = 0;
};
SolveIterations solveIterations(std::span<const scene::Cloth> cloths);

struct TileRange {
  std::uint32_t first, count;
};

// Those of cloths whose substep ends with the forces come first; then those of cloths for which a system is
// solved.
struct Tiles {
  std::vector<shared::TileRecord> records;
  std::uint32_t withoutConstraints = 0;  // of the records

  TileRange range(bool constrained) const {
    const auto all = static_cast<std::uint32_t>(records.size());
    return constrained ? TileRange{withoutConstraints, all - withoutConstraints}
                       : TileRange{0, withoutConstraints};
  }
};

// One tile a workgroup: together they cover every node of the grids once, `rowsPerInvocation` rows an
// invocation.
Tiles makeTiles(std::span<const scene::Cloth> cloths, std::uint32_t rowsPerInvocation,
                std::uint32_t workgroupSize);

// 1/kg a node; 0 for pinned nodes.
std::vector<float> inverseMasses(std::span<const scene::Cloth> cloths);

// Every node where it starts, at rest.
NodeState restState(std::span<const scene::Cloth> cloths);

}  // namespace clothstream::simulation
