// SPDX-License-Identifier: MIT
// Tables and push constants of the simulation kernels, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H
#define CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Kernels read these tables as texels of four floats, which costs a software device a tenth of storage loads.
// Whole numbers are floats too, exact below 2^24.

// One cloth, five texels: where its nodes lie in the scene's buffers, and its material. Row-major, SI units.
struct ClothRecord {
  vec4 place;      // first node modulo 2^16, first node / 2^16, rows, columns
  vec4 spacing;    // of columns, of rows, along the diagonal; damping
  vec4 stiffness;  // structural, shear, bend; friction
  vec4 damping;    // structural, shear, bend; thickness
  vec4 air;        // drag, lift
};

// One workgroup of a kernel that walks down columns: its first invocation starts at (row, column) of the
// cloth. The others follow along the row, and from its end at the start of the next strip of rows.
struct TileRecord {
  vec4 start;  // cloth, row, column
};

// A sphere over one tick, two texels: where it starts, and how far it moves until the tick's end.
struct SphereRecord {
  vec4 startRadius;
  vec4 motionFriction;
};

// What differs from substep to substep and from tick to tick.
struct AdvancePush {
  vec4 gravityStep;  // w: seconds of a substep
  vec4 windAir;      // w: air density / 6, half of it for each of a triangle's three nodes
  uint32_t sphereCount;
  float sphereProgress;  // of the tick's motion, at the end of this substep
  float tickRate;        // 1/s
  uint32_t reserved;
};

struct HashPush {
  uint32_t nodeCount;
};

// What a tick says of its state. Sums of the nodes' hashes modulo 2^32: their order does not matter.
struct StatusRecord {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t unhealthy;  // not 0: some component is not finite, or outside the world
  uint32_t reserved;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ClothRecord) == 80 && offsetof(ClothRecord, spacing) == 16 &&
              offsetof(ClothRecord, stiffness) == 32 && offsetof(ClothRecord, damping) == 48 &&
              offsetof(ClothRecord, air) == 64);
static_assert(sizeof(TileRecord) == 16);
static_assert(sizeof(SphereRecord) == 32 && offsetof(SphereRecord, motionFriction) == 16);
static_assert(sizeof(AdvancePush) == 48 && offsetof(AdvancePush, windAir) == 16 &&
              offsetof(AdvancePush, sphereCount) == 32);
static_assert(sizeof(HashPush) == 4);
static_assert(sizeof(StatusRecord) == 16 && offsetof(StatusRecord, unhealthy) == 8);
}  // namespace clothstream::shared
#endif

#endif
