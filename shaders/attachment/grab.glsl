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

// Vector from the place where a grab begins to a node.
vec3 fromGrab(GrabRecord grab, vec3 position) {
  precise vec3 away = position - grab.position;
  return away;
}

#endif
