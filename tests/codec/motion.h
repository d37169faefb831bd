// SPDX-License-Identifier: MIT
// Cloth-like motions for tests of the codec: travelling waves, with occasional jumps.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

struct MotionFrame {
  std::vector<float> positions;  // 3 floats a vertex
  std::vector<float> normals;    // 3 floats a vertex, unit length
};

// Waves of `amplitude` metres over cloths that lie side by side.
MotionFrame sampleMotion(const StreamLayout& layout, std::uint64_t tick, float amplitude);

// Puts every vertex at random within `extent` metres of the origin on each axis, with random normals. The
// result depends only on the seed.
MotionFrame scatter(const StreamLayout& layout, std::uint32_t seed, float extent);

// Odd-sized grids, a grid of one row, a grid of one vertex and a cloth that is not a grid.
StreamLayout mixedLayout(NormalMode normals);

// Angle between vectors of any length.
double degreesBetween(const float* a, const float* b);

}  // namespace clothstream::codec
