// SPDX-License-Identifier: MIT
// Vectors and other short rows of floats, as messages have them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "clients/core/wire.h"

namespace clothstream::client {

using Vec3 = std::array<float, 3>;

// Of a message whose fields 1 to N are floats. False where it is not well formed, or one is not finite.
template <std::size_t N>
[[nodiscard]] bool readFloats(Bytes message, std::array<float, N>& out) {
  out = {};
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    for (std::uint32_t i = 0; i < N; ++i) {
      if (field == fixed32(i + 1)) return setFinite(out[i], reader);
    }
    return skip(reader);
  });
}

inline bool readVec3(Bytes message, Vec3& out) {
  return readFloats(message, out);
}

}  // namespace clothstream::client
