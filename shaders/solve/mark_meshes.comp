// SPDX-License-Identifier: MIT
// Marks the springs of meshes that ACAD held last, a bit each, from the terms that prepare_springs.comp has
// computed. An invocation handles the springs of one mark.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer rows;  // WeightedSpring
layout(std430, binding = 4) writeonly buffer Marks {
  uint marks[];
};

layout(push_constant) uniform Push {
  MarkPush push;
};

void main() {
  uint number = gl_GlobalInvocationID.x;
  uint first = push.firstSpring + CLOTHSTREAM_MARKED_SPRINGS * number;
  if (first >= push.endSpring) {
    return;
  }
  uint mark = 0;
  for (uint i = 0; i < CLOTHSTREAM_MARKED_SPRINGS; ++i) {
    uint spring = min(first + i, push.endSpring - 1);
    vec3 row = weightedSpringAt(rows, spring).row;
    mark |= first + i < push.endSpring && dotProduct(row, row) > 0.0 ? 1u << i : 0u;
  }
  marks[push.firstMark + number] = mark;
}
