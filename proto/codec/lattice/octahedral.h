// SPDX-License-Identifier: MIT
// Unit normals as two signed bytes on the unfolded octahedron. The kernels do the same operations.
#pragma once

#include <cstdint>

namespace clothstream::codec {

// Components within +-kOctahedralLimit: the coordinate times it, rounded.
inline constexpr std::int32_t kOctahedralLimit = 127;

struct Octahedral {
  std::int8_t u = 0, v = 0;
};

// `normal`: 3 floats, about unit length. Within 0.6 degrees.
Octahedral encodeOctahedral(const float* normal);

// Unit length. Any bytes give a unit vector.
void decodeOctahedral(Octahedral octahedral, float* normal);

}  // namespace clothstream::codec
