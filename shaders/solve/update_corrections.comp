// SPDX-License-Identifier: MIT
// Takes the step of an iteration of conjugate gradients; a workgroup handles one chunk.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/conjugate_gradient.glsl"

void main() {
  ChunkRecord part = ownChunk();
  System system = systemAt(uint(part.system));
  SolveRecord solve = solves[system.number];
  if (solve.running != 0) {
    updateChunk(system, uint(part.chunk), solve);
  }
}
