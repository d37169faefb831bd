// SPDX-License-Identifier: MIT
// The step of an iteration of conjugate gradients, a chunk a workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/multipliers.glsl"

void main() {
  vec4 part = texelFetch(chunks, int(push.firstChunk + gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  SolveRecord solve = solves[system.number];
  if (solve.running != 0) {
    updateChunk(system, uint(part.y), solve);
  }
}
