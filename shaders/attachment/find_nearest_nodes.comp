// SPDX-License-Identifier: MIT
// Finds the distance of the nearest node that a beginning grab could grab.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass

layout(push_constant) uniform Push {
  GrabPush push;
};

// The bits of floats from 0 on order as the floats do. The minimum does not depend on the order of the
// invocations.
void measure(uint node) {
  vec4 position = texelFetch(positions, int(node));
  if (position.w == 0.0) {
    return;
  }
  for (uint grab = 0; grab < push.grabCount; ++grab) {
    GrabRecord record = grabAt(grabs, grab);
    vec3 away = fromGrab(record, position.xyz);
    float squared = dotProduct(away, away);
    if (record.state == kBeginningGrab && squared <= max(record.squaredRadius, record.squaredReach)) {
      atomicMin(reports[grab].nearest, floatBitsToUint(squared));
    }
  }
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    measure(node);
  }
}
