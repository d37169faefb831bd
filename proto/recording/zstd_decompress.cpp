// SPDX-License-Identifier: MIT
#include <zstd.h>

#include "proto/recording/decompress.h"

namespace clothstream::recording {

bool decompressZstd(std::string_view frame, std::uint64_t size, std::string& out) {
  if (ZSTD_getFrameContentSize(frame.data(), frame.size()) != size) return false;
  out.resize(size);
  return ZSTD_decompress(out.data(), out.size(), frame.data(), frame.size()) == size;
}

}  // namespace clothstream::recording
