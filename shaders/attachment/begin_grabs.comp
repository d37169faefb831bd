// SPDX-License-Identifier: MIT
// Grabs that begin take hold of the nodes within their radius or, where none is, of the nearest within reach.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 3) buffer Grabbed {
  vec4 grabbed[];  // place in the grab; its number + 1, 0: nobody's
};

layout(push_constant) uniform Push {
  GrabPush push;
};

// A node is of the grab that has it first; of those that begin together, of the first in their order.
void take(uint node) {
  vec4 position = texelFetch(positions, int(node));
  float holder = grabbed[node].w;
  bool isFree = holder == 0.0 || grabTexel(uint(holder) - 1, 4).x != kActiveGrab;
  if (position.w == 0.0 || !isFree) {
    return;
  }
  vec4 hold = vec4(0.0);
  for (uint grab = 0; grab < push.grabCount && hold.w == 0.0; ++grab) {
    vec4 state = grabTexel(grab, 4);
    vec3 away = fromGrab(grab, position.xyz);
    float squared = dotProduct(away, away);
    float nearest = uintBitsToFloat(reports[grab].nearest);
    bool isNear = squared <= state.y || (nearest > state.y && squared == nearest);
    if (state.x == kBeginningGrab && isNear) {
      hold = vec4(rotateBack(grabTexel(grab, 2), away), float(grab + 1));
      atomicAdd(reports[grab].held, 1);
    }
  }
  grabbed[node] = hold;
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    take(node);
  }
}
