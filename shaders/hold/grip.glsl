// SPDX-License-Identifier: MIT
// What kernels of grips share: the first two bindings, and how nodes are spread over invocations.
#ifndef CLOTHSTREAM_SHADERS_HOLD_GRIP_GLSL
#define CLOTHSTREAM_SHADERS_HOLD_GRIP_GLSL

#include "shaders/hold/hold.h"
#include "shaders/shared/rotation.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grips;  // GripRecord
layout(std430, binding = 1) buffer Reports {
  GripReport reports[];
};

// In all; they share the nodes.
uint invocations() {
  return gl_NumWorkGroups.x * gl_WorkGroupSize.x;
}

vec4 gripTexel(uint grip, int texel) {
  return texelFetch(grips, 5 * int(grip) + texel);
}

// From where a grip begins to take hold to a node.
vec3 fromGrip(uint grip, vec3 position) {
  precise vec3 away = position - gripTexel(grip, 0).xyz;
  return away;
}

#endif
