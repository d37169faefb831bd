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
  std::uint32_t rowA, columnA, rowB, columnB;
  SpringKind kind;
};

void addQuad(std::uint32_t row, std::uint32_t column, std::vector<BlockSpring>& springs) {
  springs.push_back({row, column, row + 1, column + 1, SpringKind::shear});
  springs.push_back({row, column + 1, row + 1, column, SpringKind::shear});
}

std::vector<BlockSpring> allOfBlock() {
  std::vector<BlockSpring> springs;
  const auto addAlong = [&](std::uint32_t step, SpringKind kind) {
    for (std::uint32_t row = 0; row < kBlock; ++row)
      for (std::uint32_t column = 0; column + step < kBlock; ++column)
        springs.push_back({row, column, row, column + step, kind});
    for (std::uint32_t row = 0; row + step < kBlock; ++row)
      for (std::uint32_t column = 0; column < kBlock; ++column)
        springs.push_back({row, column, row + step, column, kind});
  };
  addAlong(2, SpringKind::bend);
  for (std::uint32_t row = 0; row + 1 < kBlock; ++row)
    for (std::uint32_t column = 0; column + 1 < kBlock; ++column) addQuad(row, column, springs);
  addAlong(1, SpringKind::structural);
  return springs;
}

// True if the spring of a shifted block crosses a seam. Seams run through the middle of the block in both
// directions.
bool crossesSeam(const BlockSpring& spring) {
  const auto beyond = [](std::uint32_t index) { return index >= kBlock / 2; };
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
    addPass(corners, 0);
    addPass(seams, kBlock / 2);
    addPass(insides, 0);
    return std::move(colours_);
  }

 private:
  // Adds blocks that start `shift` rows and columns before a multiple of kBlock.
  void addPass(const std::vector<BlockSpring>& springs, std::uint32_t shift) {
    for (const BlockSpring& spring : springs) {
      for (std::uint32_t row = 0; row < grid_.rows + shift; row += kBlock)
        for (std::uint32_t column = 0; column < grid_.columns + shift; column += kBlock)
          addSpring(spring, row, column, shift);
      colours_.ends.push_back(static_cast<std::uint32_t>(colours_.links.size()));
    }
  }

  void addSpring(const BlockSpring& spring, std::uint32_t row, std::uint32_t column, std::uint32_t shift) {
    // Indices before the first row or column wrap around to very large values.
    const std::uint32_t rowA = row + spring.rowA - shift, rowB = row + spring.rowB - shift;
    const std::uint32_t columnA = column + spring.columnA - shift, columnB = column + spring.columnB - shift;
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

SpringColours springColours(const Cloth& cloth) {
  return cloth.mesh ? meshColours(*cloth.mesh) : GridColours(cloth.grid).make();
}

}  // namespace clothstream::model
