// SPDX-License-Identifier: MIT
// The order in which codec 2 codes vertices, coarse to fine, and from which others each is predicted.
#pragma once

#include <array>
#include <cstdint>

#include "proto/codec/array.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::size_t kWeightClasses = 6;

// Vertices that are coded together: none is predicted from another of them.
struct Phase {
  std::uint32_t begin, end;  // slots
  // Which set of weights predicts them: 0 and 1 the finest level, 2 and 3 the next, 4 and 5 all that are
  // coarser; of each pair the second is the later phase. kWeightClasses: no weights.
  std::uint32_t weightClass;
};

// A vertex's slot is its place in the coding order. Slot vertexCount is no vertex: it stands for the origin.
struct Neighbours {
  // Coded earlier, round the vertex; fewer are repeated. (parents[1] - parents[0]) and (parents[3] -
  // parents[2]) lie in the surface.
  std::array<std::uint32_t, 4> parents;
  // Coded earlier, farther out.
  std::array<std::uint32_t, 8> ring;
};
// The nearest at the finest level, coded earlier or later; the vertex itself where there is none.
using Nearest = std::array<std::uint32_t, 4>;

// From the layout alone: both ends compute the same.
struct Hierarchy {
  // False if memory is out.
  [[nodiscard]] bool build(const StreamLayout& layout);

  Array<std::uint32_t> vertexOf;  // by slot
  Array<Neighbours> neighbours;   // by slot
  Array<Nearest> nearest;         // by slot
  Array<Phase> phases;
};

}  // namespace clothstream::codec::hierarchical
