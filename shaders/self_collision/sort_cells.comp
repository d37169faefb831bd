// SPDX-License-Identifier: MIT
// Sorts the balls of a cell by node, independent of the order in which they came. Each ball counts those
// before it. Writes cannot race: no two nodes have the same rank.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer positions;
layout(std430, binding = 1) readonly buffer Entries {
  uint entries[];
};
layout(std430, binding = 2) readonly buffer Starts {
  uint starts[];
};
layout(std430, binding = 3) readonly buffer Order {
  uint order[];
};
layout(std430, binding = 4) writeonly buffer Sorted {
  vec4 sorted[];  // position, node
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

void main() {
  uint slot = gl_GlobalInvocationID.x;
  if (slot >= starts[push.cellCount]) {
    return;
  }
  uint node = order[slot];
  uint entry = entries[node];
  uint first = starts[entry];
  uint end = starts[entry + 1];
  uint place = slot;
  // Searches skip a cell with more balls.
  if (end - first <= kMaxInRow) {
    place = first;
    while (first < end) {
      place += order[first] < node ? 1 : 0;
      ++first;
    }
  }
  sorted[place] = vec4(texelFetch(positions, int(node)).xyz, float(node));
}
