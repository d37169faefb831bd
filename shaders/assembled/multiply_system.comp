// SPDX-License-Identifier: MIT
// The system matrix times the residuals, a chunk a workgroup, and the dot products of an iteration of
// conjugate gradients. Whichever workgroup of a system ends last adds up the chunks' sums, in their order.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/multipliers.glsl"

shared bool last;

void main() {
  vec4 part = texelFetch(chunks, int(push.firstChunk + gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  if (solves[system.number].running == 0) {
    return;
  }
  multiplyChunk(system, uint(part.y));
  if (self() == 0) {
    memoryBarrierBuffer();
    uint before = atomicAdd(solves[system.number].arrived, 1);
    last = (before & 0xFFFF) + 1 == before >> 16;
  }
  barrier();
  if (last) {
    memoryBarrierBuffer();
    takeSums(system, uint(part.z), push.measures != 0);
  }
}
