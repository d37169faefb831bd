// SPDX-License-Identifier: MIT
// Predicts small phases: one workgroup handles one phase after the other.
#version 450
#extension GL_GOOGLE_include_directive : require

#define MADE_QUALIFIERS coherent
#include "shaders/encode/hierarchical/place.glsl"

// Writes cannot race: the invocations handle different slots of a phase and wait for each other between
// phases.
void main() {
  for (uint i = push.firstPhase; i < push.endPhase; ++i) {
    uvec4 phase = phases[i];
    for (uint slot = phase.x + gl_LocalInvocationIndex; slot < phase.y; slot += gl_WorkGroupSize.x) {
      place(slot, phase.z);
    }
    memoryBarrierBuffer();
    barrier();
  }
}
