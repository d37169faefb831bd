// SPDX-License-Identifier: MIT
// Tables of the cloths with solver xpbd.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Passes of a sweep over a grid: model/spring_colours.h.
inline constexpr std::size_t kGridPasses = 3;

// Partition of the work. The results do not depend on it.
struct XpbdCut {
  std::uint32_t wholeWorkgroup;  // size for a whole cloth
  std::uint32_t partWorkgroup;   // size for a part of a cloth
  // Nodes of the largest cloths that one workgroup corrects.
  std::uint32_t wholeGridNodes, wholeMeshNodes;
  // Loop rounds that the device allows an invocation.
  std::uint32_t rounds;
};

// Bits of a shared::XpbdGridTile, XpbdMeshTile or XpbdNodeTile.
struct XpbdTile {
  shared::vec4 bits;
};

struct XpbdTables {
  // A mesh with one dispatch per colour.
  struct PartMesh {
    std::uint32_t cloth, iterations;
    std::vector<TileRange> colours;  // of the links
  };

  std::vector<XpbdTile> tiles;
  // Ranges of `tiles`. A tile of `nodes` has XpbdCut::partWorkgroup nodes.
  TileRange wholeGrids{}, wholeMeshes{}, nodes{};
  std::array<TileRange, kGridPasses> partGrids{};
  std::vector<shared::ColourRecord> colours;  // of meshes that one workgroup corrects
  std::vector<shared::XpbdLinkRecord> links;  // of all meshes, colour by colour
  std::vector<PartMesh> partMeshes;
  std::uint32_t partGridIterations = 0;  // the largest of any grid in parts
  std::uint32_t wholeIterations = 0;
  std::uint32_t wholeNodes = 0;          // of the largest whole cloth
  std::uint32_t roundsPerIteration = 0;  // the largest of any whole cloth
  std::uint32_t gridMultipliers = 0;     // 0 if no cloth is swept twice
  bool iterated = false;

  bool empty() const { return tiles.empty(); }
};

// Springs of a mesh between two pinned nodes are left out, because nothing can move there.
XpbdTables xpbdTables(std::span<const model::Cloth> cloths, const XpbdCut& cut);

}  // namespace clothstream::simulation
