// SPDX-License-Identifier: MIT
// Replaces the inverse masses of a state's nodes.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/types.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer InverseMasses {
  float inverseMasses[];
};
layout(std430, binding = 1) buffer Positions {
  vec4 positions[];
};

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= uint(inverseMasses.length())) {
    return;
  }
  positions[node].w = inverseMasses[node];
}
