// SPDX-License-Identifier: MIT
// A scene as the kernels read it: a record a cloth, a record a workgroup.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/state_snapshot.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// First node of each cloth, and at the end the number of nodes: clothCount + 1 numbers.
std::vector<std::uint32_t> clothOffsets(std::span<const model::Cloth> cloths);

std::vector<shared::ClothRecord> clothRecords(std::span<const model::Cloth> cloths, double substepSeconds);

struct TileRange {
  std::uint32_t first, count;
};

// What a cloth's forces are followed by in a substep.
enum class Follow : std::uint8_t {
  nothing,      // they collide at once
  solve,        // SolveStage
  corrections,  // XpbdStage; of springs there are no forces
};
inline constexpr std::array kFollows{Follow::nothing, Follow::solve, Follow::corrections};
Follow followOf(model::SolverKind kind);

// Tiles in the order of kFollows.
struct TileRanges {
  std::array<std::uint32_t, kFollows.size()> ends{};  // of each kind

  TileRange of(Follow follow) const {
    const auto i = static_cast<std::size_t>(follow);
    const std::uint32_t first = i == 0 ? 0 : ends[i - 1];
    return {first, ends[i] - first};
  }
  std::uint32_t count() const { return ends.back(); }
};

struct Tiles {
  std::vector<shared::TileRecord> records;
  TileRanges ranges;
};

// One tile a workgroup: together they cover every node of the grids once, `rowsPerInvocation` rows an
// invocation.
Tiles makeTiles(std::span<const model::Cloth> cloths, std::uint32_t rowsPerInvocation,
                std::uint32_t workgroupSize);

// 1/kg a node; 0 for pinned nodes.
std::vector<float> inverseMasses(std::span<const model::Cloth> cloths);

// Every node where it starts, at rest.
NodeState restState(std::span<const model::Cloth> cloths);

}  // namespace clothstream::simulation
