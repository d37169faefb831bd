// SPDX-License-Identifier: MIT
// The springs of a cloth in the order in which a Gauss-Seidel sweep takes them, cut into colours: no two
// springs of a colour share a node, so that a colour may be done all at once.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/springs.h"

namespace clothstream::model {

struct SpringColours {
  std::vector<SpringLink> links;    // every spring once
  std::vector<std::uint32_t> ends;  // of each colour, the place behind its last spring

  std::size_t count() const { return ends.size(); }
  std::span<const SpringLink> of(std::size_t colour) const {
    const std::uint32_t first = colour == 0 ? 0 : ends[colour - 1];
    return std::span(links).subspan(first, ends[colour] - first);
  }
};

// A grid's colours are a closed form in three passes over blocks of 4x4 nodes. An invocation of a kernel can
// take a whole block with its nodes in registers, for within a pass no two blocks share a node:
//   corners  what crosses a seam between blocks where the seams' own blocks end: two quads a block, 4
//   colours; seams    everything else that crosses a seam: blocks that lie two nodes further up and left, 34
//   colours; insides  what lies in one block: 58 colours.
// In a block bend springs come first and structural ones last: what comes last is kept best.
inline constexpr std::uint32_t kBlock = 4;
inline constexpr std::uint32_t kCornerColours = 4, kSeamColours = 34, kInsideColours = 58;

// A mesh's: in the order of its list each spring takes the first colour that is free at both its nodes; fewer
// than twice the most springs at a node.
SpringColours springColours(const Cloth& cloth);

}  // namespace clothstream::model
