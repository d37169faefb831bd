// SPDX-License-Identifier: MIT
// Solves by conjugate gradients, one workgroup per cloth, with as many iterations per dispatch as the device
// allows. It gives the same bits as alternating multiply_system.comp and update_multipliers.comp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/multipliers.glsl"

// Computes A r and decides whether to continue.
void multiply(System system, uint count, bool normOnly) {
  uint chunk = 0;
  do {
    multiplyChunk(system, chunk);
    ++chunk;
  } while (chunk < count);
  memoryBarrier();
  barrier();
  takeSums(system, count, normOnly);
  memoryBarrier();
  barrier();
}

void main() {
  System system = systemAt(push.firstSystem + gl_WorkGroupID.x);
  uint count = uint(assembledChunkAt(chunks, system.firstChunk).chunkCount);
  uint iteration = push.firstIteration;
  SolveRecord solve = solves[system.number];
  if (solve.running == 0) {
    return;
  }
  do {
    multiply(system, count, false);
    solve = solves[system.number];
    uint end = solve.running == 0 ? 0 : count;
    for (uint chunk = 0; chunk < end; ++chunk) {
      updateChunk(system, chunk, solve);
    }
    memoryBarrier();
    barrier();
    ++iteration;
  } while (solve.running != 0 && iteration < push.endIteration);
  if (solve.running != 0 && push.measures != 0) {
    multiply(system, count, true);
  }
}
