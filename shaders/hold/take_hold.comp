// SPDX-License-Identifier: MIT
// Grips that begin take hold of the nodes within their radius or, where none is, of the nearest within reach.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/hold/grip.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 3) buffer Holds {
  vec4 holds[];  // place in the grip; its number + 1, 0: nobody's
};

layout(push_constant) uniform Push {
  GripPush push;
};

// A node is of the grip that has it first; of those that begin together, of the first in their order.
void take(uint node) {
  vec4 position = texelFetch(positions, int(node));
  float holder = holds[node].w;
  bool isFree = holder == 0.0 || gripTexel(uint(holder) - 1, 4).x != kHoldingGrip;
  if (position.w == 0.0 || !isFree) {
    return;
  }
  vec4 hold = vec4(0.0);
  for (uint grip = 0; grip < push.gripCount && hold.w == 0.0; ++grip) {
    vec4 state = gripTexel(grip, 4);
    vec3 away = fromGrip(grip, position.xyz);
    float squared = dotProduct(away, away);
    float nearest = uintBitsToFloat(reports[grip].nearest);
    bool isNear = squared <= state.y || (nearest > state.y && squared == nearest);
    if (state.x == kTakingGrip && isNear) {
      hold = vec4(rotateBack(gripTexel(grip, 2), away), float(grip + 1));
      atomicAdd(reports[grip].held, 1);
    }
  }
  holds[node] = hold;
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    take(node);
  }
}
