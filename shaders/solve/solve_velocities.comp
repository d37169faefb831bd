// SPDX-License-Identifier: MIT
// Solves by conjugate gradients, one workgroup per cloth, with as many iterations per dispatch as the device
// allows. It gives the same bits as alternating multiply_residuals.comp and update_corrections.comp.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/conjugate_gradient.glsl"

void main() {
  System system = systemAt(push.firstSystem + gl_WorkGroupID.x);
  uint iteration = push.firstIteration;
  SolveRecord solve;
  do {
    uint chunk = 0;
    do {
      multiplyChunk(system, chunk);
      ++chunk;
    } while (chunk < system.chunks);
    memoryBarrier();
    barrier();
    takeSums(system, false);
    memoryBarrier();
    barrier();
    solve = solves[system.number];
    uint end = solve.running == 0 ? 0 : system.chunks;
    chunk = 0;
    do {
      updateChunk(system, chunk, solve);
      ++chunk;
    } while (chunk < end);
    memoryBarrier();
    barrier();
    ++iteration;
  } while (solve.running != 0 && iteration < push.endIteration);
  uint chunk = 0;
  do {
    measureChunk(system, chunk);
    ++chunk;
  } while (chunk < system.chunks);
  memoryBarrier();
  barrier();
  takeSums(system, true);
}
