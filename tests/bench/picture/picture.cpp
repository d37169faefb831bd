// SPDX-License-Identifier: MIT
// Pictures as pixels, and as PNG files.
#include "tests/bench/picture/picture.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>

#include <fmt/format.h>
#include <png.h>

namespace clothstream::bench {
namespace {

constexpr std::size_t kChannels = 3;

}  // namespace

Picture sideBySide(std::span<const Picture> pictures) {
  Picture all;
  for (const Picture& one : pictures) {
    assert(all.height == 0 || all.height == one.height);
    all.width += one.width;
    all.height = one.height;
  }
  all.pixels.reserve(kChannels * all.width * all.height);
  for (std::size_t row = 0; row < all.height; ++row)
    for (const Picture& one : pictures) {
      const auto from = one.pixels.begin() + static_cast<std::ptrdiff_t>(kChannels * one.width * row);
      all.pixels.insert(all.pixels.end(), from, from + static_cast<std::ptrdiff_t>(kChannels * one.width));
    }
  return all;
}

void writePng(const Picture& picture, const std::filesystem::path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = picture.width;
  image.height = picture.height;
  image.format = PNG_FORMAT_RGB;
  if (png_image_write_to_file(&image, file.c_str(), 0, picture.pixels.data(), 0, nullptr) == 0)
    throw std::runtime_error(fmt::format("{}: {}", file.string(), image.message));
}

}  // namespace clothstream::bench
