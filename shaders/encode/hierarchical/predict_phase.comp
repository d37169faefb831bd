// SPDX-License-Identifier: MIT
// The vertices of one phase: none of them is predicted from another.
#version 450
#extension GL_GOOGLE_include_directive : require

#define MADE_QUALIFIERS
#include "shaders/encode/hierarchical/place.glsl"

// Writes cannot race: each invocation takes one slot. What it reads of the moment is of earlier phases.
void main() {
  uvec4 phase = phases[push.firstPhase];
  uint slot = phase.x + gl_GlobalInvocationID.x;
  if (slot >= phase.y) {
    return;
  }
  place(slot, phase.z);
}
