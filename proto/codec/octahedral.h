// SPDX-License-Identifier: MIT
// Unit normals as two signed bytes on the unfolded octahedron. The kernels compute the same.
#pragma once

#include <cstdint>

namespace clothstream::codec {

// Range of a component: the coordinate times this limit, rounded, from -kOctahedralLimit to kOctahedralLimit.
inline constexpr std::int32_t kOctahedralLimit = 127;

struct Octahedral {
  std::int8_t u = 0, v = 0;
};

// `normal` is 3 floats of about unit length. The error is below one degree.
Octahedral encodeOctahedral(const float* normal);
// Encodes a vector of any length with components of at most 2^15.
Octahedral encodeOctahedral(std::int32_t x, std::int32_t y, std::int32_t z);

// Writes a vector of unit length, for any bytes.
void decodeOctahedral(Octahedral octahedral, float* normal);

}  // namespace clothstream::codec
