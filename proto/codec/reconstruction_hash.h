// SPDX-License-Identifier: MIT
// 64-bit hash of a reconstruction's integers. It is a sum over vertices, so it does not depend on their
// order.
#pragma once

#include <cstdint>

namespace clothstream::codec {

// Two halves, each a sum modulo 2^32 of one word for each vertex (FRAME_FORMAT.md). The kernels compute the
// same.
class ReconstructionHash {
 public:
  // x, y, z are in units. `normal` is the bytes u | v << 8, or 0 if the stream sends no normals.
  void add(std::uint32_t vertex, std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t normal) {
    low_ += word(vertex, x, y, z, normal, 0x243f6a88u);
    high_ += word(vertex, x, y, z, normal, 0x85a308d3u);
  }

  std::uint64_t value() const { return std::uint64_t{high_} << 32 | low_; }

 private:
  // Bijection of 32 bits in which each bit of the input changes each bit of the output.
  static constexpr std::uint32_t mix(std::uint32_t h) {
    h = (h ^ h >> 16) * 0x7feb352du;
    h = (h ^ h >> 15) * 0x846ca68bu;
    return h ^ h >> 16;
  }

  static constexpr std::uint32_t word(std::uint32_t vertex, std::int32_t x, std::int32_t y, std::int32_t z,
                                      std::uint32_t normal, std::uint32_t seed) {
    std::uint32_t h = mix(vertex + seed);
    h = mix(h ^ static_cast<std::uint32_t>(x));
    h = mix(h ^ static_cast<std::uint32_t>(y));
    h = mix(h ^ static_cast<std::uint32_t>(z));
    return mix(h ^ normal);
  }

  std::uint32_t low_ = 0, high_ = 0;
};

}  // namespace clothstream::codec
