// SPDX-License-Identifier: MIT
// Beginning grabs grab the nodes within their radius of the point at which they begin. Without such a node
// they grab the nearest node within reach.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/grab.glsl"

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 3) buffer GrabbedNodes {
  GrabbedNode grabbed[];
};

layout(push_constant) uniform Push {
  GrabPush push;
};

// A node belongs to the grab that had it first. Of grabs that begin together, the first in their order gets
// it.
void take(uint node) {
  vec4 position = texelFetch(positions, int(node));
  float grabber = grabbed[node].grabber;
  bool isFree = grabber == 0.0 || grabAt(grabs, uint(grabber) - 1).state != kActiveGrab;
  if (position.w == 0.0 || !isFree) {
    return;
  }
  GrabbedNode taken = GrabbedNode(vec3(0.0), 0.0);
  for (uint grab = 0; grab < push.grabCount && taken.grabber == 0.0; ++grab) {
    GrabRecord record = grabAt(grabs, grab);
    if (!begins(record)) {
      continue;
    }
    precise vec3 away = position.xyz - beginOf(record, positions);
    float squared = dotProduct(away, away);
    float nearest = uintBitsToFloat(reports[grab].nearest);
    bool isNear = squared <= record.squaredRadius || (nearest > record.squaredRadius && squared == nearest);
    if (isNear) {
      taken = GrabbedNode(rotateBack(record.orientation, away), float(grab + 1));
      atomicAdd(reports[grab].grabbed, 1);
    }
  }
  grabbed[node] = taken;
}

void main() {
  for (uint grab = gl_GlobalInvocationID.x; grab < push.grabCount; grab += invocations()) {
    GrabRecord record = grabAt(grabs, grab);
    if (begins(record)) {
      precise vec3 offset = beginOf(record, positions) - record.position;
      reports[grab].offset = offset;
    }
  }
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += invocations()) {
    take(node);
  }
}
