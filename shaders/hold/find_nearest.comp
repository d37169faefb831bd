// SPDX-License-Identifier: MIT
// How far the nearest node is that a grip could take hold of.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/hold/grip.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass

layout(push_constant) uniform Push {
  GripPush push;
};

// The bits of floats from 0 on are in the order of the floats: their least does not depend on who comes
// first.
void measure(uint node) {
  vec4 position = texelFetch(positions, int(node));
  if (position.w == 0.0) {
    return;
  }
  for (uint grip = 0; grip < push.gripCount; ++grip) {
    vec4 state = gripTexel(grip, 4);
    vec3 away = fromGrip(grip, position.xyz);
    float squared = dotProduct(away, away);
    if (state.x == kTakingGrip && squared <= max(state.y, state.z)) {
      atomicMin(reports[grip].nearest, floatBitsToUint(squared));
    }
  }
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    measure(node);
  }
}
