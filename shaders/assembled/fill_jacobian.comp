// SPDX-License-Identifier: MIT
// J at the substep's start, in CSR with a block of three numbers an entry, and b; [Va21] Alg. 2. One chunk a
// workgroup; every row belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/rows.glsl"

layout(binding = 3) uniform samplerBuffer links;       // LinkRecord
layout(binding = 4) uniform samplerBuffer positions;   // at the substep's start; w: inverse mass
layout(binding = 5) uniform samplerBuffer velocities;  // those that the forces alone give
layout(std430, binding = 6) writeonly buffer Blocks {
  vec4 blocks[];  // two a row; w: the inverse mass of the column's node
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
  vec4 link = texelFetch(links, int(row));
  vec4 a = texelFetch(positions, int(link.x));
  vec4 b = texelFetch(positions, int(link.y));
  precise vec3 d = b.xyz - a.xyz;
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise vec3 direction = inverseLength * d;
  precise vec3 relative = texelFetch(velocities, int(link.y)).xyz - texelFetch(velocities, int(link.x)).xyz;
  precise float excess = correctionFraction * (squared * inverseLength - link.z);
  precise float side = push.substepRate * excess + dotProduct(direction, relative);
  blocks[2 * row] = vec4(-direction, a.w);
  blocks[2 * row + 1] = vec4(direction, b.w);
  vectors[row] = vec4(side, 0.0, 0.0, 0.0);
}

void main() {
  vec4 part = texelFetch(chunks, int(gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  uint chunk = uint(part.y);
  float correctionFraction = texelFetch(cloths, system.cloth + 6).y;
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
    solves[system.number] =
        SolveRecord(0, 0.0, system.endRow - system.firstRow, 1, 0.0, 0.0, 0.0, 0.0, uint(part.z) << 16);
  }
}
