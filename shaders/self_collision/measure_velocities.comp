// SPDX-License-Identifier: MIT
// Computes the box of all balls' velocities, which bounds how fast two of them can approach. An invocation
// handles every stride-th node and adds its result with integer atomics, whose order does not matter.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;  // RestRecord
layout(binding = 1) uniform samplerBuffer velocities;
layout(std430, binding = 2) buffer Table {
  uint table[];
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

// Bits of a float that order as the numbers do. 0 is below all of them.
uint ordered(float number) {
  uint bits = floatBitsToUint(number);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

void main() {
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
  uvec3 high = uvec3(0), low = uvec3(0);
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += stride) {
    if (isBall(restAt(rests, node))) {
      vec3 v = texelFetch(velocities, int(node)).xyz;
      precise vec3 opposite = -v;
      high = max(high, uvec3(ordered(v.x), ordered(v.y), ordered(v.z)));
      low = max(low, uvec3(ordered(opposite.x), ordered(opposite.y), ordered(opposite.z)));
    }
  }
  uint words = push.cellCount + push.cellCount / kCellBlock;
  for (int i = 0; i < 3; ++i) {
    atomicMax(table[words + i], high[i]);
    atomicMax(table[words + 3 + i], low[i]);
  }
}
