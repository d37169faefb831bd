// SPDX-License-Identifier: MIT
// A solve by conjugate gradients, one workgroup a cloth, as many iterations in a dispatch as the device lets
// it. The same bits as by multiply_system.comp and update_multipliers.comp in turn.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/multipliers.glsl"

// A r, and whether to go on.
void multiply(System system, uint count, bool norm) {
  uint chunk = 0;
  do {
    multiplyChunk(system, chunk);
    ++chunk;
  } while (chunk < count);
  memoryBarrier();
  barrier();
  takeSums(system, count, norm);
  memoryBarrier();
  barrier();
}

void main() {
  System system = systemAt(push.firstSystem + gl_WorkGroupID.x);
  uint count = uint(texelFetch(chunks, int(system.firstChunk)).z);
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
