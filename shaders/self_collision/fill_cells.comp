// SPDX-License-Identifier: MIT
// Gives every ball a place in its cell, in arbitrary order. sort_cells.comp sorts them.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;  // RestRecord
layout(std430, binding = 1) readonly buffer Entries {
  uint entries[];
};
layout(std430, binding = 2) buffer Table {
  uint table[];  // place of the entry's next ball
};
layout(std430, binding = 3) writeonly buffer Order {
  uint order[];
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount || !isBall(restAt(rests, node))) {
    return;
  }
  order[atomicAdd(table[entries[node]], 1u)] = node;
}
