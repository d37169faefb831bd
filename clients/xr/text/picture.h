// SPDX-License-Identifier: MIT
// A picture of texts and rectangles in memory.
#pragma once

#include <cstdint>
#include <vector>

namespace clothstream::xr {

struct Picture {
  std::uint32_t width = 0, height = 0;
  // 4 bytes per texel: red, green, blue in sRGB encoding, multiplied with alpha, and alpha. The first row is
  // on top.
  std::vector<std::uint8_t> texels;
  // Changes with the texels, and differs between pictures of a process.
  std::uint64_t revision = 0;
};

}  // namespace clothstream::xr
