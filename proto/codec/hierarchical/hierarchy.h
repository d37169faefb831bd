// SPDX-License-Identifier: MIT
// Coding order of all cloths, coarse to fine, and the neighbours that each vertex is predicted from.
#pragma once

#include <cstdint>

#include "proto/codec/array.h"
#include "proto/codec/hierarchical/coding_order.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

// Vertices that are coded together. None of them is predicted from another.
struct Phase {
  std::uint32_t begin, end;  // range of slots
  std::uint32_t weightClass;
};

// Follows from the layout alone, so both ends compute the same. The slot of a vertex is its place in the
// coding order: by phase, then by number. Slot vertexCount is the origin, not a vertex.
struct Hierarchy {
  // False if memory is out.
  [[nodiscard]] bool build(const StreamLayout& layout);

  Array<std::uint32_t> vertexOf;  // indexed by slot
  Array<Neighbours> neighbours;   // indexed by slot; holds slots
  Array<Nearest> nearest;         // indexed by slot; holds slots
  Array<Phase> phases;
  // Number of the first phases, which hold all coarse vertices and depend on no others.
  std::size_t coarsePhases = 0;
  std::uint32_t coarseVertices = 0;
};

}  // namespace clothstream::codec::hierarchical
