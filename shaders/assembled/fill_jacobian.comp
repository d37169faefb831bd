// SPDX-License-Identifier: MIT
// Computes J at the substep's start, in CSR format with a block of three numbers per entry, and b; [Va21]
// Alg. 2. A workgroup handles one chunk; every row belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/rows.glsl"

layout(binding = 3) uniform samplerBuffer links;       // LinkRecord
layout(binding = 4) uniform samplerBuffer positions;   // at the substep's start; w: inverse mass
layout(binding = 5) uniform samplerBuffer velocities;  // of the free motion
layout(std430, binding = 6) writeonly buffer Blocks {
  vec4 blocks[];  // JacobianBlock, two per row
};
layout(std430, binding = 7) writeonly buffer Vectors {
  vec4 vectors[];
};
layout(std430, binding = 8) writeonly buffer Solves {
  SolveRecord solves[];
};

layout(push_constant) uniform Push {
  AssemblePush push;
};

void fillRow(uint row, float correctionFraction) {
  LinkRecord link = linkAt(links, row);
  vec4 a = texelFetch(positions, int(link.a));
  vec4 b = texelFetch(positions, int(link.b));
  precise vec3 d = b.xyz - a.xyz;
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise vec3 direction = inverseLength * d;
  precise vec3 relative = texelFetch(velocities, int(link.b)).xyz - texelFetch(velocities, int(link.a)).xyz;
  precise float excess = correctionFraction * (squared * inverseLength - link.restLength);
  precise float side = push.substepRate * excess + dotProduct(direction, relative);
  blocks[2 * row] = vec4(-direction, a.w);
  blocks[2 * row + 1] = vec4(direction, b.w);
  vectors[row] = texelFrom(RowState(side, 0.0, 0.0, 0.0));
}

void main() {
  AssembledChunkRecord part = assembledChunkAt(chunks, gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  uint chunk = uint(part.chunk);
  float correctionFraction = clothAt(cloths, system.cloth).correctionFraction;
  uint lane = self();
  do {
    uint k = 0;
    do {
      uint row = rowAt(system, chunk, k, lane);
      if (row < system.endRow) {
        fillRow(row, correctionFraction);
      }
      ++k;
    } while (k < kLaneRows);
    lane += width();
  } while (lane < kLanes);
  if (chunk == 0 && self() == 0) {
    solves[system.number] = SolveRecord(0, 0.0, system.endRow - system.firstRow, 1, 0.0, 0.0, 0.0, 0.0,
                                        uint(part.chunkCount) << 16);
  }
}
