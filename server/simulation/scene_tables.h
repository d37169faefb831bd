// SPDX-License-Identifier: MIT
// Tables of a scene: one record per cloth and one per workgroup.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/state_snapshot.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// First node of each cloth, then the number of nodes: clothCount + 1 numbers.
std::vector<std::uint32_t> clothOffsets(std::span<const model::Cloth> cloths);

std::vector<shared::ClothRecord> clothRecords(std::span<const model::Cloth> cloths, double substepSeconds);

struct TileRange {
  std::uint32_t first, count;
};

// The stage that follows a cloth's forces in a substep.
enum class Follow : std::uint8_t {
  nothing,  // no stage: the advance kernel also collides
  solve,    // SolveStage
  limit,    // SolveStage with acad, by its mode
  paper,
  corrections,  // XpbdStage: springs are no forces
  gas,          // GasStage alone, which also collides
};
inline constexpr std::array kFollows{Follow::nothing, Follow::solve,       Follow::limit,
                                     Follow::paper,   Follow::corrections, Follow::gas};
// With any solver but mass_spring, gas acts before the stage of the solver.
Follow followOf(const model::Cloth& cloth);
// Without gas.
Follow followOf(const model::Solver& solver);
// The Follow of acad with this mode.
Follow followOf(model::AcadMode mode);

// StateBuffers::stretches: index of the first number of a dispatch size, of the size of the kernel that
// continues long solves, and of the mark of the scene's first node.
constexpr std::uint32_t firstStretchSize(Follow follow) {
  return 3 * static_cast<std::uint32_t>(follow);
}
constexpr std::uint32_t firstContinuedSize(Follow follow) {
  return 3 * kFollows.size() + firstStretchSize(follow);
}
constexpr std::uint32_t kFirstMark = 6 * kFollows.size();

// End of the tiles of each kind, in the order of kFollows.
struct TileRanges {
  std::array<std::uint32_t, kFollows.size()> ends{};

  TileRange of(Follow follow) const {
    const auto i = static_cast<std::size_t>(follow);
    const std::uint32_t first = i == 0 ? 0 : ends[i - 1];
    return {first, ends[i] - first};
  }
  std::uint32_t count() const { return ends.back(); }
};

// Tiles of all grids or all meshes.
template <typename Record>
struct TileTable {
  std::vector<Record> records;
  TileRanges ranges;
};
using Tiles = TileTable<shared::TileRecord>;
using MeshTiles = TileTable<shared::MeshTileRecord>;

// One tile per workgroup. Together they cover every node of the grids once, with `rowsPerInvocation` rows per
// invocation.
Tiles makeTiles(std::span<const model::Cloth> cloths, std::uint32_t rowsPerInvocation,
                std::uint32_t workgroupSize);

// 1/kg by node; 0 for pinned nodes.
std::vector<float> inverseMasses(std::span<const model::Cloth> cloths);

// Every node at its rest position, with zero velocity.
NodeState restState(std::span<const model::Cloth> cloths);
// Every node at its start position, relative to `origin`, with zero velocity.
NodeState startState(const model::Scene& scene, const model::Vec3& origin);

}  // namespace clothstream::simulation
