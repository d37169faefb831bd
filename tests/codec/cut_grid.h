// SPDX-License-Identifier: MIT
// A grid cut into an irregular mesh, to measure the cost of irregular cloth.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// Cuts each quad along one of its diagonals and numbers the vertices in random order. The result depends only
// on the size.
class CutGrid {
 public:
  explicit CutGrid(std::uint32_t edge);

  const codec::ClothLayout& cloth() const { return cloth_; }
  // Positions of the grid in the mesh's order, 3 floats a vertex. Valid until the next call.
  std::span<const float> renumbered(std::span<const float> positions);

 private:
  codec::ClothLayout cloth_;
  std::vector<std::uint32_t> numbers_;  // indexed by vertex of the grid
  std::vector<float> positions_;
};

}  // namespace clothstream::codec
