// SPDX-License-Identifier: MIT
// Computes the hash of the state, whether it is healthy, and where it is, by integer sums and maxima, whose
// order does not matter.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/simulation.h"
#include "shaders/shared/state_hash.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer positions;
layout(binding = 1) uniform samplerBuffer velocities;
layout(std430, binding = 2) buffer Status {
  StatusRecord status;
};

layout(push_constant) uniform Push {
  HashPush push;
};

// Each invocation handles every stride-th node and adds its result with integer atomics.
void main() {
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
  NodeHash sum = NodeHash(0, 0);
  uint unhealthy = 0;
  uvec3 invertedLow = uvec3(0u);
  uvec3 high = uvec3(0u);
  for (uint node = gl_GlobalInvocationID.x; node < push.nodeCount; node += stride) {
    uvec3 p = floatBitsToUint(texelFetch(positions, int(node)).xyz);
    uvec3 v = floatBitsToUint(texelFetch(velocities, int(node)).xyz);
    NodeHash hash = hashNode(node, p.x, p.y, p.z, v.x, v.y, v.z);
    sum.low += hash.low;
    sum.high += hash.high;
    if (isOutsideWorld(p.x) || isOutsideWorld(p.y) || isOutsideWorld(p.z) || isOutsideWorld(v.x) ||
        isOutsideWorld(v.y) || isOutsideWorld(v.z)) {
      unhealthy |= kOutsideWorld;
    }
    if (isBeyond(p.x, push.reach) || isBeyond(p.y, push.reach) || isBeyond(p.z, push.reach)) {
      unhealthy |= kOutOfReach;
    }
    precise vec3 inWorld = push.origin + uintBitsToFloat(p);
    uvec3 w = floatBitsToUint(inWorld);
    uvec3 place = uvec3(orderOf(w.x), orderOf(w.y), orderOf(w.z));
    invertedLow = max(invertedLow, ~place);
    high = max(high, place);
  }
  atomicAdd(status.hashLow, sum.low);
  atomicAdd(status.hashHigh, sum.high);
  if (unhealthy != 0) {
    atomicOr(status.unhealthy, unhealthy);
  }
  for (int axis = 0; axis < 3; ++axis) {
    atomicMax(status.invertedLow[axis], invertedLow[axis]);
    atomicMax(status.high[axis], high[axis]);
  }
}
