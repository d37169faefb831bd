// SPDX-License-Identifier: MIT
// A grid as a mesh, for measuring what irregular cloth costs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// Each quad is cut one way or the other and the vertices are numbered in any order; a function of the size.
class CutGrid {
 public:
  explicit CutGrid(std::uint32_t edge);

  const codec::ClothLayout& cloth() const { return cloth_; }
  // The grid's positions, 3 floats a vertex, in the mesh's order; valid until the next call.
  std::span<const float> renumbered(std::span<const float> positions);

 private:
  codec::ClothLayout cloth_;
  std::vector<std::uint32_t> numbers_;  // of the grid's vertices
  std::vector<float> positions_;
};

}  // namespace clothstream::codec
