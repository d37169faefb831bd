// SPDX-License-Identifier: MIT
// Multiplies the system matrix by the residuals and computes the dot products of an iteration of conjugate
// gradients. A workgroup handles one chunk. The workgroup of a system that ends last adds up the chunks' sums
// in their order.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/multipliers.glsl"

shared bool last;

void main() {
  AssembledChunkRecord part = assembledChunkAt(chunks, push.firstChunk + gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  if (solves[system.number].running == 0) {
    return;
  }
  multiplyChunk(system, uint(part.chunk));
  if (self() == 0) {
    memoryBarrierBuffer();
    uint before = atomicAdd(solves[system.number].arrived, 1);
    last = (before & 0xFFFF) + 1 == before >> 16;
  }
  barrier();
  if (last) {
    memoryBarrierBuffer();
    takeSums(system, uint(part.chunkCount), push.measures != 0);
  }
}
