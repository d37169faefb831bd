// SPDX-License-Identifier: MIT
// Table of square roots for unit vectors.
#include "proto/codec/hierarchical/surface_frame.h"

namespace clothstream::codec::hierarchical::detail {
namespace {

constexpr std::array<std::uint16_t, 4096> makeRoots() {
  std::array<std::uint16_t, 4096> roots{};
  for (std::size_t i = 1024; i < roots.size(); ++i) {
    // 2^28 / sqrt((i + 1/2) 2^16) = 2^20 / sqrt(i + 1/2): r^2 (2 i + 1) <= 2^41.
    std::uint64_t root = 0;
    for (std::uint64_t bit = 1 << 15; bit != 0; bit >>= 1) {
      if ((root | bit) * (root | bit) * (2 * i + 1) <= std::uint64_t{1} << 41) root |= bit;
    }
    roots[i] = static_cast<std::uint16_t>(root);
  }
  return roots;
}

}  // namespace

constinit const std::array<std::uint16_t, 4096> kRoots = makeRoots();

}  // namespace clothstream::codec::hierarchical::detail
