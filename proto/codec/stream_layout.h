// SPDX-License-Identifier: MIT
// What encoder and decoder know of a stream before its first packet.
#pragma once

#include <cstdint>
#include <vector>

namespace clothstream::codec {

enum class NormalMode : std::uint8_t { none = 0, octahedral = 1 };

// Vertices are row-major where rows and columns are not zero.
struct ClothLayout {
  std::uint32_t vertexCount = 0;
  std::uint32_t rows = 0, columns = 0;
};

struct StreamLayout {
  std::uint32_t epoch = 0;
  float maxError = 0.0005f;  // m an axis: the promise the encoder keeps
  NormalMode normals = NormalMode::none;
  std::vector<ClothLayout> cloths;

  std::uint32_t vertexCount() const {
    std::uint32_t sum = 0;
    for (const ClothLayout& cloth : cloths) sum += cloth.vertexCount;
    return sum;
  }
};

}  // namespace clothstream::codec
