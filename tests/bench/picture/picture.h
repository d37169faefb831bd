// SPDX-License-Identifier: MIT
// Pictures as pixels, and as PNG files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace clothstream::bench {

// Pixels row by row from the upper left corner: red, green, blue.
struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

// Joins pictures of the same height from left to right.
Picture sideBySide(std::span<const Picture> pictures);

// Throws std::runtime_error if the file cannot be written.
void writePng(const Picture& picture, const std::filesystem::path& file);

}  // namespace clothstream::bench
