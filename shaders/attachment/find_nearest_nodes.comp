// SPDX-License-Identifier: MIT
// Finds the distance of the nearest node that a beginning grab could grab.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass

layout(push_constant) uniform Push {
  GrabPush push;
};

// Squared distance within which a grab looks for a node. At a point of the cloth, the nodes around the point
// are within it.
float squaredReach(GrabRecord grab, vec3 begin) {
  if (grab.state != kBeginningGrabAtPlace) {
    return grab.squaredReach;
  }
  float farthest = 0.0;
  for (int corner = 0; corner < 3; ++corner) {
    precise vec3 away = nodeOfPoint(grab, corner, positions) - begin;
    farthest = max(farthest, dotProduct(away, away));
  }
  return farthest;
}

// The bits of floats from 0 on order as the floats do. The minimum does not depend on the order of the
// invocations.
void measure(uint node) {
  vec4 position = texelFetch(positions, int(node));
  if (position.w == 0.0) {
    return;
  }
  for (uint grab = 0; grab < push.grabCount; ++grab) {
    GrabRecord record = grabAt(grabs, grab);
    if (!begins(record)) {
      continue;
    }
    vec3 begin = beginOf(record, positions);
    precise vec3 away = position.xyz - begin;
    float squared = dotProduct(away, away);
    if (squared <= max(record.squaredRadius, squaredReach(record, begin))) {
      atomicMin(reports[grab].nearest, floatBitsToUint(squared));
    }
  }
}

void main() {
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    measure(node);
  }
}
