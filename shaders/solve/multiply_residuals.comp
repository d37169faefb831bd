// SPDX-License-Identifier: MIT
// The matrix times the preconditioned residuals, a chunk a workgroup, and the dot products of an iteration of
// conjugate gradients. Whichever workgroup of a system ends last adds up the chunks' sums, in their order.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/conjugate_gradient.glsl"

// Only the residual's norm, for the report.
layout(constant_id = 5) const bool kMeasure = false;

layout(std430, binding = 13) buffer Groups {
  uint groups[];  // three numbers an iteration: how many workgroups it takes
};

shared bool last;

void main() {
  vec4 part = ownChunk();
  System system = systemAt(uint(part.x));
  if (kMeasure) {
    measureChunk(system, uint(part.y));
  } else {
    multiplyChunk(system, uint(part.y));
  }
  if (self() == 0) {
    memoryBarrierBuffer();
    uint before = atomicAdd(solves[system.number].arrived, 1);
    last = (before & 0xFFFF) + 1 == before >> 16;
  }
  barrier();
  if (last) {
    memoryBarrierBuffer();
    takeSums(system, kMeasure);
    if (self() == 0 && !kMeasure && solves[system.number].running != 0) {
      atomicMax(groups[push.nextGroup], gl_NumWorkGroups.x);
    }
  }
}
