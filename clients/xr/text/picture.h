// SPDX-License-Identifier: MIT
// A picture of texts and rectangles in memory.
#pragma once

#include <cstdint>
#include <vector>

namespace clothstream::xr {

// A rectangle of texels; right and bottom are outside of it.
struct TexelRect {
  std::uint32_t left = 0, top = 0, right = 0, bottom = 0;
  bool operator==(const TexelRect&) const = default;
};

struct Picture {
  std::uint32_t width = 0, height = 0;
  // 4 bytes per texel: red, green, blue in sRGB encoding, multiplied with alpha, and alpha. The first row is
  // on top.
  std::vector<std::uint8_t> texels;
  // Changes with the texels, and differs between pictures of a process.
  std::uint64_t revision = 0;
  // The texels outside of `changes` are those of the picture with the revision `since`. 0: all may differ.
  std::uint64_t since = 0;
  std::vector<TexelRect> changes;
};

// Height of the bands of rows in which findChanges() looks for changes.
inline constexpr std::uint32_t kChangeRows = 16;

// Fills in `since` and `changes` of a picture: a rectangle for each band of rows that differs from `before`.
void findChanges(const Picture& before, Picture& picture);

}  // namespace clothstream::xr
