// SPDX-License-Identifier: MIT
// The first two bindings of the kernels of grabs, and the distribution of nodes over invocations.
#ifndef CLOTHSTREAM_SHADERS_ATTACHMENT_GRAB_GLSL
#define CLOTHSTREAM_SHADERS_ATTACHMENT_GRAB_GLSL

#include "shaders/attachment/attachment.h"
#include "shaders/shared/rotation.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grabs;  // GrabRecord
layout(std430, binding = 1) buffer Reports {
  GrabReport reports[];
};

// Number of all invocations, which share the nodes.
uint invocations() {
  return gl_NumWorkGroups.x * gl_WorkGroupSize.x;
}

bool begins(GrabRecord grab) {
  return grab.state >= kBeginningGrab;
}

// Node `corner` of the point at which a grab begins.
vec3 nodeOfPoint(GrabRecord grab, int corner, samplerBuffer positions) {
  return texelFetch(positions, int(grab.nodes[corner])).xyz;
}

// Point at which a grab begins.
vec3 beginOf(GrabRecord grab, samplerBuffer positions) {
  if (grab.state != kBeginningGrabAtPlace) {
    return grab.position;
  }
  precise vec3 point = grab.weights.x * nodeOfPoint(grab, 0, positions) +
                       grab.weights.y * nodeOfPoint(grab, 1, positions) +
                       grab.weights.z * nodeOfPoint(grab, 2, positions);
  return point;
}

#endif
