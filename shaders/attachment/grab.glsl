// SPDX-License-Identifier: MIT
// What kernels of grabs share: the first two bindings, and how nodes are spread over invocations.
#ifndef CLOTHSTREAM_SHADERS_ATTACHMENT_GRAB_GLSL
#define CLOTHSTREAM_SHADERS_ATTACHMENT_GRAB_GLSL

#include "shaders/attachment/attachment.h"
#include "shaders/shared/rotation.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grabs;  // GrabRecord
layout(std430, binding = 1) buffer Reports {
  GrabReport reports[];
};

// In all; they share the nodes.
uint invocations() {
  return gl_NumWorkGroups.x * gl_WorkGroupSize.x;
}

vec4 grabTexel(uint grab, int texel) {
  return texelFetch(grabs, 5 * int(grab) + texel);
}

// From where a grab begins to take hold to a node.
vec3 fromGrab(uint grab, vec3 position) {
  precise vec3 away = position - grabTexel(grab, 0).xyz;
  return away;
}

#endif
