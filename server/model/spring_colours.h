// SPDX-License-Identifier: MIT
// Springs of a cloth in the order of a Gauss-Seidel sweep, grouped by colour. No two springs of a colour
// share a node, so all springs of a colour can be processed in parallel.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/springs.h"

namespace clothstream::model {

struct SpringColours {
  std::vector<SpringLink> links;    // all springs
  std::vector<std::uint32_t> ends;  // end index of each colour in `links`

  std::size_t count() const { return ends.size(); }
  std::span<const SpringLink> of(std::size_t colour) const {
    const std::uint32_t first = colour == 0 ? 0 : ends[colour - 1];
    return std::span(links).subspan(first, ends[colour] - first);
  }
};

// Colours of a grid have a closed form: three passes over blocks of 4x4 nodes. Within a pass no two blocks
// share a node, so a kernel invocation can process a whole block with its nodes in registers.
//   corners: springs across a seam near the corners of blocks, two quads per block, 4 colours
//   seams:   all other springs across a seam; blocks are shifted by two nodes up and left, 34 colours
//   insides: springs inside a block, 58 colours
// Within a block bend springs come first and structural springs last, because the last ones are satisfied
// best. A spring and its mirror image follow each other without a spring between them that shares a node with
// either, and blocks lie symmetrically in grids with an even number of rows and of columns. A sweep over such
// a grid therefore keeps the symmetry of the cloth.
inline constexpr std::int32_t kBlock = 4;
inline constexpr std::uint32_t kCornerColours = 4, kSeamColours = 34, kInsideColours = 58;

// Blocks along the rows or the columns of a grid. The first and the last one may reach beyond the grid.
struct BlockLine {
  std::int32_t first;  // row or column where the first block starts, negative if it reaches beyond
  std::uint32_t count;
};
// Blocks of the pass "seams", or of the other two, along `nodes` rows or columns.
BlockLine blockLine(std::uint32_t nodes, bool seams);

// Colours of a cloth. For a mesh each spring, in the order of its list, gets the first colour that is free at
// both nodes. The number of colours is less than twice the maximum number of springs at a node.
SpringColours springColours(const Cloth& cloth);

}  // namespace clothstream::model
