// SPDX-License-Identifier: MIT
// How far the nearest node is that a grab could take hold of.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass

layout(push_constant) uniform Push {
  GrabPush push;
};

// The bits of floats from 0 on are in the order of the floats: their least does not depend on who comes
// first.
void measure(uint node) {
  vec4 position = texelFetch(positions, int(node));
  if (position.w == 0.0) {
    return;
  }
  for (uint grab = 0; grab < push.grabCount; ++grab) {
    vec4 state = grabTexel(grab, 4);
    vec3 away = fromGrab(grab, position.xyz);
    float squared = dotProduct(away, away);
    if (state.x == kBeginningGrab && squared <= max(state.y, state.z)) {
      atomicMin(reports[grab].nearest, floatBitsToUint(squared));
    }
  }
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    measure(node);
  }
}
