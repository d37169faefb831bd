// SPDX-License-Identifier: MIT
// The box of all balls' velocities: how fast any two of them can come together. Every invocation takes each
// stride-th node and adds what it found with atomics on integers, whose order does not matter.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;  // w: cloth + 1; 0: no ball
layout(binding = 1) uniform samplerBuffer velocities;
layout(std430, binding = 2) buffer Table {
  uint table[];
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

// A float's bits, so that they order as the numbers do; 0 is below all of them.
uint ordered(float number) {
  uint bits = floatBitsToUint(number);
  return (bits & 0x80000000u) != 0 ? ~bits : bits | 0x80000000u;
}

void main() {
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
  uvec3 high = uvec3(0), low = uvec3(0);
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += stride) {
    if (texelFetch(rests, int(node)).w != 0.0) {
      vec3 v = texelFetch(velocities, int(node)).xyz;
      high = max(high, uvec3(ordered(v.x), ordered(v.y), ordered(v.z)));
      low = max(low, uvec3(ordered(-v.x), ordered(-v.y), ordered(-v.z)));
    }
  }
  uint words = push.cellCount + push.cellCount / kCellBlock;
  for (int i = 0; i < 3; ++i) {
    atomicMax(table[words + i], high[i]);
    atomicMax(table[words + 3 + i], low[i]);
  }
}
