// SPDX-License-Identifier: MIT
// A grid cut into an irregular mesh.
#include "tests/codec/cut_grid.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace clothstream::codec {

CutGrid::CutGrid(std::uint32_t edge)
    : cloth_{.vertexCount = edge * edge}, numbers_(edge * edge), positions_(3 * std::size_t{edge} * edge) {
  std::mt19937 random(edge);
  std::iota(numbers_.begin(), numbers_.end(), 0u);
  std::shuffle(numbers_.begin(), numbers_.end(), random);
  std::vector<std::uint32_t>& triangles = cloth_.triangles;
  for (std::uint32_t row = 0; row + 1 < edge; ++row) {
    for (std::uint32_t column = 0; column + 1 < edge; ++column) {
      const std::uint32_t i = row * edge + column;
      const std::uint32_t a = numbers_[i], b = numbers_[i + 1], c = numbers_[i + edge],
                          d = numbers_[i + edge + 1];
      if (random() % 2 == 0)
        triangles.insert(triangles.end(), {a, c, b, b, c, d});
      else
        triangles.insert(triangles.end(), {a, c, d, a, d, b});
    }
  }
  cloth_.restPositions.resize(3 * numbers_.size());
  for (std::uint32_t i = 0; i < numbers_.size(); ++i) {
    float* place = &cloth_.restPositions[3 * std::size_t{numbers_[i]}];
    place[0] = static_cast<float>(i % edge);
    place[1] = static_cast<float>(i / edge);
  }
}

std::span<const float> CutGrid::renumbered(std::span<const float> positions) {
  for (std::size_t i = 0; i < numbers_.size(); ++i)
    std::copy_n(&positions[3 * i], 3, &positions_[3 * std::size_t{numbers_[i]}]);
  return positions_;
}

}  // namespace clothstream::codec
