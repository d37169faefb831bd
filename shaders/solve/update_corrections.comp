// SPDX-License-Identifier: MIT
// The step of an iteration of conjugate gradients, a chunk a workgroup.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/conjugate_gradient.glsl"

void main() {
  vec4 part = ownChunk();
  System system = systemAt(uint(part.x));
  updateChunk(system, uint(part.y), solves[system.number]);
}
