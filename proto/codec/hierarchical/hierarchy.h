// SPDX-License-Identifier: MIT
// The order in which codec 2 codes the vertices of all cloths, coarse to fine, and from which others each is
// predicted.
#pragma once

#include <cstdint>

#include "proto/codec/array.h"
#include "proto/codec/hierarchical/coding_order.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

// Vertices that are coded together: none is predicted from another of them.
struct Phase {
  std::uint32_t begin, end;  // slots
  std::uint32_t weightClass;
};

// From the layout alone: both ends compute the same. A vertex's slot is its place in the coding order, by
// phase, then by number. Slot vertexCount is no vertex: it stands for the origin.
struct Hierarchy {
  // False if memory is out.
  [[nodiscard]] bool build(const StreamLayout& layout);

  Array<std::uint32_t> vertexOf;  // by slot
  Array<Neighbours> neighbours;   // by slot, slots
  Array<Nearest> nearest;         // by slot, slots
  Array<Phase> phases;
  // The first ones are of all coarse vertices, which need none of the others.
  std::size_t coarsePhases = 0;
  std::uint32_t coarseVertices = 0;
};

}  // namespace clothstream::codec::hierarchical
