// SPDX-License-Identifier: MIT
#include "clients/xr/text/picture.h"

#include <atomic>

#include "clients/xr/text/painter.h"

namespace clothstream::xr {

void clear(Picture& picture, std::uint32_t width, std::uint32_t height) {
  picture.width = width;
  picture.height = height;
  picture.texels.assign(std::size_t{4} * width * height, 0);
}

void touch(Picture& picture) {
  static std::atomic<std::uint64_t> revisions = 0;
  picture.revision = ++revisions;
}

}  // namespace clothstream::xr
