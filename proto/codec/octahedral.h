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

// `normal`: 3 floats, about unit length. Within a degree.
Octahedral encodeOctahedral(const float* normal);
// Of a vector of any length, each component 2^15 at most.
Octahedral encodeOctahedral(std::int32_t x, std::int32_t y, std::int32_t z);

// Unit length. Any bytes give a unit vector.
void decodeOctahedral(Octahedral octahedral, float* normal);

}  // namespace clothstream::codec
