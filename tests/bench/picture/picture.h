// SPDX-License-Identifier: MIT
// Pixels, and files of them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace clothstream::bench {

// Row by row from the upper left corner; red, green, blue a pixel.
struct Picture {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
};

// Pictures of one height, from left to right.
Picture besideEachOther(std::span<const Picture> pictures);

// Throws std::runtime_error where it cannot be written.
void writePng(const Picture& picture, const std::filesystem::path& file);

}  // namespace clothstream::bench
