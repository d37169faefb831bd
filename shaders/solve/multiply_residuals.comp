// SPDX-License-Identifier: MIT
// Multiplies the matrix by the preconditioned residuals and computes the dot products of an iteration of
// conjugate gradients. A workgroup handles one chunk. The workgroup of a system that ends last adds up the
// chunks' sums in their order.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/conjugate_gradient.glsl"

// True: only measures the residual's norm, for the report.
layout(constant_id = 5) const bool kMeasure = false;

layout(std430, binding = 13) buffer Groups {
  uint groups[];  // dispatch sizes, three numbers per iteration
};

shared bool last;

void main() {
  ChunkRecord part = ownChunk();
  System system = systemAt(uint(part.system));
  if (push.firstIteration > 0 && solves[system.number].running == 0) {
    return;
  }
  if (kMeasure) {
    measureChunk(system, uint(part.chunk));
  } else {
    multiplyChunk(system, uint(part.chunk));
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
