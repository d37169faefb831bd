// SPDX-License-Identifier: MIT
// Every ball takes a place in its cell, in whatever order: sort_cells.comp puts them right.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;  // w: cloth + 1; 0: no ball
layout(std430, binding = 1) readonly buffer Entries {
  uint entries[];
};
layout(std430, binding = 2) buffer Table {
  uint table[];  // where the entry's next ball goes
};
layout(std430, binding = 3) writeonly buffer Order {
  uint order[];
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount || texelFetch(rests, int(node)).w == 0.0) {
    return;
  }
  order[atomicAdd(table[entries[node]], 1u)] = node;
}
