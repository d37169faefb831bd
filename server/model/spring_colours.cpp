// SPDX-License-Identifier: MIT
// Assigns colours to springs: a closed form for grids, greedy for meshes.
#include "server/model/spring_colours.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <unordered_map>

#include "server/model/mesh.h"

namespace clothstream::model {
namespace {

// Spring by the positions of its ends within a block.
struct BlockSpring {
  std::int32_t rowA, columnA, rowB, columnB;
  SpringKind kind;
};

void addQuad(std::int32_t row, std::int32_t column, std::vector<BlockSpring>& springs) {
  springs.push_back({row, column, row + 1, column + 1, SpringKind::shear});
  springs.push_back({row, column + 1, row + 1, column, SpringKind::shear});
}

// A part of springs that are mirror images of each other comes before the next part.
std::vector<BlockSpring> allOfBlock() {
  std::vector<BlockSpring> springs;
  const auto addAlong = [&](std::int32_t step, SpringKind kind) {
    for (std::int32_t part = 0; part < 2; ++part)
      for (std::int32_t row = 0; row < kBlock; ++row)
        for (std::int32_t column = part; column + step < kBlock; column += 2)
          springs.push_back({row, column, row, column + step, kind});
    for (std::int32_t part = 0; part < 2; ++part)
      for (std::int32_t row = part; row + step < kBlock; row += 2)
        for (std::int32_t column = 0; column < kBlock; ++column)
          springs.push_back({row, column, row + step, column, kind});
  };
  addAlong(2, SpringKind::bend);
  for (std::int32_t part = 0; part < 4; ++part)
    for (std::int32_t row = part / 2; row + 1 < kBlock; row += 2)
      for (std::int32_t column = part % 2; column + 1 < kBlock; column += 2) addQuad(row, column, springs);
  addAlong(1, SpringKind::structural);
  return springs;
}

// True if the spring of a shifted block crosses a seam. Seams run through the middle of the block in both
// directions.
bool crossesSeam(const BlockSpring& spring) {
  const auto beyond = [](std::int32_t index) { return index >= kBlock / 2; };
  return beyond(spring.rowA) != beyond(spring.rowB) || beyond(spring.columnA) != beyond(spring.columnB);
}

class GridColours {
 public:
  explicit GridColours(const Grid& grid) : grid_(grid), lengths_(spacing(grid)) {}

  SpringColours make() {
    std::vector<BlockSpring> corners, seams, insides = allOfBlock();
    addQuad(1, kBlock - 1, corners);
    addQuad(kBlock - 1, 1, corners);
    std::ranges::copy_if(insides, std::back_inserter(seams), &crossesSeam);
    assert(corners.size() == kCornerColours && seams.size() == kSeamColours &&
           insides.size() == kInsideColours);
    addPass(corners, false);
    addPass(seams, true);
    addPass(insides, false);
    return std::move(colours_);
  }

 private:
  void addPass(const std::vector<BlockSpring>& springs, bool shifted) {
    const BlockLine rows = blockLine(grid_.rows, shifted), columns = blockLine(grid_.columns, shifted);
    for (const BlockSpring& spring : springs) {
      for (std::uint32_t i = 0; i < rows.count; ++i)
        for (std::uint32_t k = 0; k < columns.count; ++k)
          addSpring(spring, rows.first + kBlock * static_cast<std::int32_t>(i),
                    columns.first + kBlock * static_cast<std::int32_t>(k));
      colours_.ends.push_back(static_cast<std::uint32_t>(colours_.links.size()));
    }
  }

  void addSpring(const BlockSpring& spring, std::int32_t row, std::int32_t column) {
    // Indices before the first row or column wrap around to very large values.
    const auto rowA = static_cast<std::uint32_t>(row + spring.rowA),
               rowB = static_cast<std::uint32_t>(row + spring.rowB),
               columnA = static_cast<std::uint32_t>(column + spring.columnA),
               columnB = static_cast<std::uint32_t>(column + spring.columnB);
    if (std::max(rowA, rowB) >= grid_.rows || std::max(columnA, columnB) >= grid_.columns) return;
    const std::uint32_t a = rowA * grid_.columns + columnA, b = rowB * grid_.columns + columnB;
    const float step = rowA == rowB ? lengths_.column : lengths_.row;
    const float length = spring.kind == SpringKind::shear  ? lengths_.diagonal
                         : spring.kind == SpringKind::bend ? 2 * step
                                                           : step;
    colours_.links.push_back({std::min(a, b), std::max(a, b), spring.kind, length});
  }

  const Grid& grid_;
  GridSpacing lengths_;
  SpringColours colours_;
};

// Colours in use at each node, as sets of 64. Most nodes need only the first set, so the others are stored
// sparsely: the memory is linear in the number of nodes and springs.
class ColoursAtNodes {
 public:
  explicit ColoursAtNodes(std::uint32_t nodes) : first_(nodes, 0) {}

  // Returns the first colour that is free at both nodes, and marks it as used at both.
  std::uint32_t takeFirstFree(std::uint32_t a, std::uint32_t b) {
    for (std::uint32_t word = 0;; ++word) {
      const std::uint64_t taken = setOf(a, word) | setOf(b, word);
      if (taken == ~std::uint64_t{0}) continue;
      const auto bit = static_cast<std::uint32_t>(std::countr_one(taken));
      for (const std::uint32_t node : {a, b})
        (word == 0 ? first_[node] : others_[key(node, word)]) |= std::uint64_t{1} << bit;
      return 64 * word + bit;
    }
  }

 private:
  static std::uint64_t key(std::uint32_t node, std::uint32_t word) {
    return std::uint64_t{node} << 32 | word;
  }
  std::uint64_t setOf(std::uint32_t node, std::uint32_t word) const {
    if (word == 0) return first_[node];
    const auto found = others_.find(key(node, word));
    return found == others_.end() ? 0 : found->second;
  }

  std::vector<std::uint64_t> first_;
  std::unordered_map<std::uint64_t, std::uint64_t> others_;
};

SpringColours meshColours(const Mesh& mesh) {
  ColoursAtNodes nodes(mesh.nodeCount());
  std::vector<std::vector<SpringLink>> byColour;
  for (const SpringLink& link : mesh.links) {
    const std::uint32_t colour = nodes.takeFirstFree(link.a, link.b);
    if (colour == byColour.size()) byColour.emplace_back();
    byColour[colour].push_back(link);
  }
  SpringColours colours;
  for (const std::vector<SpringLink>& links : byColour) {
    colours.links.insert(colours.links.end(), links.begin(), links.end());
    colours.ends.push_back(static_cast<std::uint32_t>(colours.links.size()));
  }
  return colours;
}

}  // namespace

// Rows before the first block are as many as behind the last one, unless the number of rows is odd.
BlockLine blockLine(std::uint32_t nodes, bool seams) {
  const std::int32_t start = (nodes % kBlock == 2 ? -1 : 0) - (seams ? kBlock / 2 : 0);
  return {start,
          static_cast<std::uint32_t>((static_cast<std::int32_t>(nodes) - start + kBlock - 1) / kBlock)};
}

SpringColours springColours(const Cloth& cloth) {
  return cloth.mesh ? meshColours(*cloth.mesh) : GridColours(cloth.grid).make();
}

}  // namespace clothstream::model
