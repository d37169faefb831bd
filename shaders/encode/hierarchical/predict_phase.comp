// SPDX-License-Identifier: MIT
// Predicts the vertices of one phase; no vertex of a phase depends on another one.
#version 450
#extension GL_GOOGLE_include_directive : require

#define MADE_QUALIFIERS
#include "shaders/encode/hierarchical/place.glsl"

// Writes cannot race: each invocation handles one slot and only reads results of earlier phases.
void main() {
  uvec4 phase = phases[push.firstPhase];
  uint slot = phase.x + gl_GlobalInvocationID.x;
  if (slot >= phase.y) {
    return;
  }
  place(slot, phase.z);
}
