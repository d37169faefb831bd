// SPDX-License-Identifier: MIT
// The constraints' system as sparse matrices, [Va21] 3.2.2, and the partition of its rows among invocations.
//   (J M^-1 J^T + c) lambda = b,   u = -M^-1 J^T lambda                                       [Va21] Eq. 3-11
// where u is the change of the nodes' velocities.
//
// A chunk has kLanes lanes of kLaneRows rows each. Dot products add up along a lane, then the lanes of a
// chunk in a tree, then the chunks in lanes and a tree. This order does not depend on the device, on the
// workgroup's size, or on which workgroup handles which chunk. Loops over lanes and chunks test last
// (shaders/solve/linear_system.glsl).
#ifndef CLOTHSTREAM_SHADERS_ASSEMBLED_ROWS_GLSL
#define CLOTHSTREAM_SHADERS_ASSEMBLED_ROWS_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/assembled/assembled.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"
#include "shaders/shared/simulation.h"

layout(binding = 0) uniform samplerBuffer cloths;   // ClothRecord
layout(binding = 1) uniform samplerBuffer systems;  // AssembledSystemRecord
layout(binding = 2) uniform samplerBuffer chunks;   // AssembledChunkRecord

const uint kLaneRows = CLOTHSTREAM_ASSEMBLED_LANE_ROWS;

// The vectors of conjugate gradients: two texels per row, in two halves of the buffer.
const uint kStates = 0, kProducts = 1;

struct System {
  uint number;
  uint cloth;
  uint firstRow, endRow;
  uint firstChunk;
};

System systemAt(uint number) {
  AssembledSystemRecord record = assembledSystemAt(systems, number);
  return System(number, uint(record.cloth), uint(record.firstRow), uint(record.endRow),
                uint(record.firstChunk));
}

// Row `k` of a lane. It is at or past the system's end if the lane has no such row.
uint rowAt(System system, uint chunk, uint k, uint lane) {
  return system.firstRow + (chunk * kLaneRows + k) * kLanes + lane;
}

#endif
