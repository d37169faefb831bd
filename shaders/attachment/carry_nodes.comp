// SPDX-License-Identifier: MIT
// Moves a cloth as a rigid body, with its velocities.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/attachment.h"
#include "shaders/shared/rotation.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 1) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  CarryPush push;
};

vec3 turned(vec3 v) {
  return rotate(push.toOrientation, rotateBack(push.fromOrientation, v));
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.nodeCount) {
    return;
  }
  uint node = push.firstNode + i;
  precise vec3 arm = positions[node].xyz - push.from;
  precise vec3 position = push.to + turned(arm);
  positions[node].xyz = snapTiny(position);
  velocities[node].xyz = snapTiny(turned(velocities[node].xyz));
}
