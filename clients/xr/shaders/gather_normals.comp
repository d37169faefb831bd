#version 450
// SPDX-License-Identifier: MIT
// Normals of nodes: the normalised sum of (c - p) x (b - a) over the faces around the node p, as in
// proto/codec/vertex_normals.h. Each invocation writes the normal of its own node.
#extension GL_GOOGLE_include_directive : require
#include "clients/xr/shaders/records.h"

layout(local_size_x = 64) in;
layout(set = 0, binding = kPositionsBinding, std430) readonly buffer Positions {
  float positions[];
};
layout(set = 0, binding = kNormalsBinding, std430) writeonly buffer Normals {
  float normals[];
};
layout(set = 0, binding = kFanStartsBinding, std430) readonly buffer FanStarts {
  uint fanStarts[];
};
layout(set = 0, binding = kFansBinding, std430) readonly buffer Fans {
  uint fans[];
};
layout(push_constant) uniform Range {
  uint first, end;
};

vec3 positionOf(uint node) {
  return vec3(positions[3 * node], positions[3 * node + 1], positions[3 * node + 2]);
}

void main() {
  uint node = first + gl_GlobalInvocationID.x;
  if (node >= end) return;
  vec3 p = positionOf(node);
  vec3 sum = vec3(0.0);
  for (uint face = fanStarts[node]; face < fanStarts[node + 1]; ++face) {
    vec3 a = positionOf(fans[3 * face]);
    vec3 c = positionOf(fans[3 * face + 1]);
    vec3 b = positionOf(fans[3 * face + 2]);
    sum += cross(c - p, b - a);
  }
  float squared = dot(sum, sum);
  vec3 normal = squared >= 1e-30 ? sum * inversesqrt(squared) : vec3(0.0, 0.0, 1.0);
  normals[3 * node] = normal.x;
  normals[3 * node + 1] = normal.y;
  normals[3 * node + 2] = normal.z;
}
