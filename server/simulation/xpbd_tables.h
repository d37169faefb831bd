// SPDX-License-Identifier: MIT
// The cloths that xpbd moves as its kernels read them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Passes of a sweep over a grid: scene/spring_colours.h.
inline constexpr std::size_t kGridPasses = 3;

// How the work is cut; the results do not depend on it.
struct XpbdCut {
  std::uint32_t wholeWorkgroup;  // of a cloth that one workgroup corrects
  std::uint32_t partWorkgroup;   // of part of a cloth
  // The largest cloths that one workgroup corrects, nodes.
  std::uint32_t wholeGridNodes, wholeMeshNodes;
  // Rounds of loops that the device lets an invocation make.
  std::uint32_t rounds;
};

struct XpbdTables {
  // A mesh whose colours are dispatches of their own.
  struct PartMesh {
    std::uint32_t cloth, iterations;
    std::vector<TileRange> colours;  // of the links
  };

  std::vector<shared::XpbdTile> tiles;
  TileRange wholeGrids{}, wholeMeshes{}, nodes{};  // of the tiles; nodes: XpbdCut::partWorkgroup each
  std::array<TileRange, kGridPasses> partGrids{};
  std::vector<shared::ColourRecord> colours;  // of meshes that one workgroup corrects
  std::vector<shared::XpbdLinkRecord> links;  // of all meshes, colour by colour
  std::vector<PartMesh> partMeshes;
  std::uint32_t partGridIterations = 0;  // the most of any grid in parts, of any cloth as a whole
  std::uint32_t wholeIterations = 0;
  std::uint32_t roundsPerIteration = 0;  // the most of a cloth as a whole
  std::uint32_t gridMultipliers = 0;     // none where no cloth is swept twice
  bool iterated = false;

  bool empty() const { return tiles.empty(); }
};

// Springs between two pinned nodes of a mesh are left out: nothing can move there.
XpbdTables xpbdTables(std::span<const model::Cloth> cloths, const XpbdCut& cut);

}  // namespace clothstream::simulation
