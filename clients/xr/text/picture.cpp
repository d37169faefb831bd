// SPDX-License-Identifier: MIT
#include "clients/xr/text/picture.h"

#include <algorithm>
#include <atomic>
#include <cstring>

#include "clients/xr/text/painter.h"

namespace clothstream::xr {
namespace {

constexpr std::size_t kTexelBytes = 4;

// Extends `rect` by the columns in which a row of two pictures differs.
void addRow(const std::uint8_t* before, const std::uint8_t* after, std::uint32_t width, TexelRect& rect) {
  const auto differs = [&](std::uint32_t column) {
    return std::memcmp(before + kTexelBytes * column, after + kTexelBytes * column, kTexelBytes) != 0;
  };
  if (std::memcmp(before, after, kTexelBytes * width) == 0) return;
  std::uint32_t first = 0, end = width;
  while (!differs(first)) ++first;
  while (!differs(end - 1)) --end;
  rect.left = std::min(rect.left, first);
  rect.right = std::max(rect.right, end);
}

}  // namespace

void clear(Picture& picture, std::uint32_t width, std::uint32_t height) {
  picture.width = width;
  picture.height = height;
  picture.texels.assign(kTexelBytes * width * height, 0);
}

void touch(Picture& picture) {
  static std::atomic<std::uint64_t> revisions = 0;
  picture.revision = ++revisions;
  picture.since = 0;
}

void findChanges(const Picture& before, Picture& picture) {
  picture.since = 0;
  picture.changes.clear();
  if (before.revision == 0 || before.width != picture.width || before.height != picture.height) return;
  const std::size_t rowBytes = kTexelBytes * picture.width;
  for (std::uint32_t top = 0; top < picture.height; top += kChangeRows) {
    TexelRect rect{picture.width, top, 0, std::min(top + kChangeRows, picture.height)};
    for (std::uint32_t row = rect.top; row < rect.bottom; ++row)
      addRow(&before.texels[row * rowBytes], &picture.texels[row * rowBytes], picture.width, rect);
    if (rect.left < rect.right) picture.changes.push_back(rect);
  }
  picture.since = before.revision;
}

}  // namespace clothstream::xr
