// SPDX-License-Identifier: MIT
// What the encoding kernels and the CPU share of a frame, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_FRAME_H
#define CLOTHSTREAM_SHADERS_ENCODE_FRAME_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

struct EncodePush {
  uint32_t vertexCount;
  uint32_t predicted;  // 1: the reference frame may be used
  float step;          // m
  float inverseStep;
};

// What a frame's kernels gather by integer atomics, whose order does not matter. Zero before the first
// kernel.
struct FrameStatus {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t residualBits;  // zigzag residuals of all positions, or-ed
  uint32_t reserved;
  uint32_t positionCosts[5];  // by prediction
  uint32_t normalCosts[5];
  uint32_t reserved2[2];
};

// Where a vertex's neighbours are: bit 31 says that there is one before it in its row, the other bits how far
// back the one above it is; 0 there for none.
CLOTHSTREAM_SHARED_FUNCTION bool hasLeft(uint32_t neighbours) {
  return (neighbours & 0x80000000u) != 0u;
}
CLOTHSTREAM_SHARED_FUNCTION uint32_t distanceUp(uint32_t neighbours) {
  return neighbours & 0x7FFFFFFFu;
}

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(EncodePush) == 16 && offsetof(EncodePush, step) == 8);
static_assert(sizeof(FrameStatus) == 64 && offsetof(FrameStatus, positionCosts) == 16 &&
              offsetof(FrameStatus, normalCosts) == 36);
}  // namespace clothstream::shared
#endif

#endif
