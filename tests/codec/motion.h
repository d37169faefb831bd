// SPDX-License-Identifier: MIT
// Cloth-like motions for tests of the codec: smooth waves that travel, with jumps now and then.
#pragma once

#include <cstdint>
#include <vector>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

struct MotionFrame {
  std::vector<float> positions;  // 3 a vertex
  std::vector<float> normals;    // 3 a vertex, unit length
};

// Waves of `amplitude` metres over cloths that lie side by side.
MotionFrame sampleMotion(const StreamLayout& layout, std::uint64_t tick, float amplitude);

// Every vertex anywhere within `extent` metres of the origin on each axis, normals any way; a function of the
// seed.
MotionFrame scatter(const StreamLayout& layout, std::uint32_t seed, float extent);

// Odd-sized grids, a grid of one row, one of one vertex, a cloth that is no grid.
StreamLayout mixedLayout(NormalMode normals, std::uint8_t codec = kCodecHierarchical);

// Of vectors of any length.
double degreesBetween(const float* a, const float* b);

}  // namespace clothstream::codec
