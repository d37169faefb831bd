// SPDX-License-Identifier: MIT
// Phases so small that one workgroup takes one after the other.
#version 450
#extension GL_GOOGLE_include_directive : require

#define MADE_QUALIFIERS coherent
#include "shaders/encode/hierarchical/place.glsl"

// Writes cannot race: each invocation takes other slots of a phase, and all wait for each other between
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
