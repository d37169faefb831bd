// SPDX-License-Identifier: MIT
// The constraints' system as sparse matrices, [Va21] 3.2.2, and how its rows are cut: what the kernels share.
//   (J M^-1 J^T + c) lambda = b,   u = -M^-1 J^T lambda                                       [Va21] Eq. 3-11
// where u is what the velocities of the nodes change by.
//
// Rows are cut into chunks of kLanes lanes of kLaneRows rows each. Dot products add up along a lane, then the
// lanes of a chunk in a tree, then the chunks in lanes and a tree: nothing of that depends on the device, on
// the workgroup's size, or on who does which chunk. Loops over lanes and chunks test last (shaders/solve).
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

// The vectors of conjugate gradients, two texels a row which lie apart. A state is the residual r, direction
// p, A p and lambda; a product is A r.
const uint kStates = 0, kProducts = 1;

struct System {
  uint number;
  int cloth;  // first texel of its record
  uint firstRow, endRow;
  uint firstChunk;
};

System systemAt(uint number) {
  vec4 rows = texelFetch(systems, int(number));
  return System(number, CLOTHSTREAM_CLOTH_TEXELS * int(rows.x), uint(rows.y), uint(rows.z), uint(rows.w));
}

// At or past the system's end where the lane has no such row.
uint rowAt(System system, uint chunk, uint k, uint lane) {
  return system.firstRow + (chunk * kLaneRows + k) * kLanes + lane;
}

#endif
