// SPDX-License-Identifier: MIT
// Tables of the cloths with solver xpbd.
#include "server/simulation/xpbd_tables.h"

#include <algorithm>
#include <bit>
#include <cassert>

#include "server/model/spring_colours.h"

namespace clothstream::simulation {
namespace {

// A whole number as two floats that hold its parts exactly.
struct Parts {
  explicit Parts(std::size_t number)
      : low(static_cast<float>(number & 0xFFFFFF)), high(static_cast<float>(number >> 24)) {}
  float low, high;
};

// Number of blocks of each pass over a grid.
std::array<std::uint32_t, kGridPasses> blocksOf(const model::Grid& grid) {
  const auto blocks = [&](bool seams) {
    return model::blockLine(grid.rows, seams).count * model::blockLine(grid.columns, seams).count;
  };
  return {blocks(false), blocks(true), blocks(false)};
}

std::uint32_t multipliersOf(const model::Grid& grid) {
  const auto blocks = blocksOf(grid);
  return blocks[0] * model::kCornerColours + blocks[1] * model::kSeamColours +
         blocks[2] * model::kInsideColours;
}

class XpbdTablesMaker {
 public:
  XpbdTablesMaker(std::span<const model::Cloth> cloths, const XpbdCut& cut) : cloths_(cloths), cut_(cut) {}

  XpbdTables make() {
    const std::vector<std::uint32_t> offsets = clothOffsets(cloths_);
    std::vector<Grid> whole, parts;
    std::vector<XpbdTile> meshTiles;
    for (std::uint32_t i = 0; i < cloths_.size(); ++i) {
      const model::Cloth& cloth = cloths_[i];
      if (cloth.solver.kind != model::SolverKind::xpbd) continue;
      tables_.iterated = tables_.iterated || cloth.solver.iterations > 1;
      if (cloth.mesh)
        addMesh(i, offsets[i], meshTiles);
      else
        (addGrid(cloth) ? whole : parts).push_back({i, multipliers_});
      if (!cloth.mesh) multipliers_ += multipliersOf(cloth.grid);
    }
    tables_.gridMultipliers = tables_.iterated ? multipliers_ : 0;
    for (const Grid& grid : whole) addTile(grid, 0);
    tables_.wholeGrids = rangeFrom(0);
    for (std::size_t pass = 0; pass < kGridPasses; ++pass) {
      const std::size_t first = tables_.tiles.size();
      for (const Grid& grid : parts)
        for (std::uint32_t block = 0; block < blocksOf(cloths_[grid.cloth].grid)[pass];
             block += cut_.partWorkgroup)
          addTile(grid, block);
      tables_.partGrids[pass] = rangeFrom(first);
    }
    std::size_t first = tables_.tiles.size();
    tables_.tiles.insert(tables_.tiles.end(), meshTiles.begin(), meshTiles.end());
    tables_.wholeMeshes = rangeFrom(first);
    first = tables_.tiles.size();
    for (std::uint32_t i = 0; i < cloths_.size(); ++i)
      if (cloths_[i].solver.kind == model::SolverKind::xpbd)
        for (std::uint32_t node = 0; node < cloths_[i].nodeCount(); node += cut_.partWorkgroup)
          tables_.tiles.push_back(std::bit_cast<XpbdTile>(
              shared::XpbdNodeTile{static_cast<float>(i), static_cast<float>(node), 0, 0}));
    tables_.nodes = rangeFrom(first);
    return std::move(tables_);
  }

 private:
  struct Grid {
    std::uint32_t cloth;
    std::uint32_t firstMultiplier;
  };

  TileRange rangeFrom(std::size_t first) const {
    return {static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(tables_.tiles.size() - first)};
  }

  void addTile(const Grid& grid, std::uint32_t block) {
    const Parts multiplier(tables_.iterated ? grid.firstMultiplier : 0);
    tables_.tiles.push_back(std::bit_cast<XpbdTile>(shared::XpbdGridTile{
        static_cast<float>(grid.cloth), static_cast<float>(block), multiplier.low, multiplier.high}));
  }

  std::uint32_t roundsOf(std::uint32_t elements) const { return elements / cut_.wholeWorkgroup + 2; }

  // True if one workgroup can correct a cloth that takes `rounds` loop rounds per iteration.
  bool takeWhole(const model::Cloth& cloth, std::uint32_t limit, std::uint32_t rounds) {
    if (cloth.nodeCount() > limit || rounds > cut_.rounds) return false;
    tables_.roundsPerIteration = std::max(tables_.roundsPerIteration, rounds);
    tables_.wholeIterations = std::max(tables_.wholeIterations, cloth.solver.iterations);
    tables_.wholeNodes = std::max(tables_.wholeNodes, cloth.nodeCount());
    return true;
  }

  bool addGrid(const model::Cloth& cloth) {
    std::uint32_t rounds = 2;
    for (const std::uint32_t blocks : blocksOf(cloth.grid)) rounds += roundsOf(blocks);
    if (takeWhole(cloth, cut_.wholeGridNodes, rounds)) return true;
    tables_.partGridIterations = std::max(tables_.partGridIterations, cloth.solver.iterations);
    return false;
  }

  void addMesh(std::uint32_t number, std::uint32_t firstNode, std::vector<XpbdTile>& tiles) {
    const model::Cloth& cloth = cloths_[number];
    const model::SpringColours colours = model::springColours(cloth);
    const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
    XpbdTables::PartMesh mesh{number, cloth.solver.iterations, {}};
    std::uint32_t rounds = 2;
    for (std::size_t colour = 0; colour < colours.count(); ++colour) {
      const std::size_t first = tables_.links.size();
      for (const model::SpringLink& link : colours.of(colour))
        if (pinned[link.a] == 0 || pinned[link.b] == 0)
          tables_.links.push_back({static_cast<float>(firstNode + link.a),
                                   static_cast<float>(firstNode + link.b), link.restLength,
                                   static_cast<float>(link.kind)});
      const auto count = static_cast<std::uint32_t>(tables_.links.size() - first);
      if (count == 0) continue;
      mesh.colours.push_back({static_cast<std::uint32_t>(first), count});
      rounds += roundsOf(count) + 1;
    }
    if (mesh.colours.empty()) return;
    if (!takeWhole(cloth, cut_.wholeMeshNodes, rounds)) {
      tables_.partMeshes.push_back(std::move(mesh));
      return;
    }
    tiles.push_back(std::bit_cast<XpbdTile>(
        shared::XpbdMeshTile{static_cast<float>(number), static_cast<float>(tables_.colours.size()),
                             static_cast<float>(mesh.colours.size()), 0}));
    for (const TileRange& colour : mesh.colours) {
      const Parts first(colour.first);
      tables_.colours.push_back({first.low, first.high, static_cast<float>(colour.count), 0});
    }
  }

  std::span<const model::Cloth> cloths_;
  const XpbdCut& cut_;
  XpbdTables tables_;
  std::uint32_t multipliers_ = 0;
};

}  // namespace

XpbdTables xpbdTables(std::span<const model::Cloth> cloths, const XpbdCut& cut) {
  return XpbdTablesMaker(cloths, cut).make();
}

}  // namespace clothstream::simulation
