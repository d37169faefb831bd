// SPDX-License-Identifier: MIT
// Shortens the motion of each node to its share. If a list of pairs overflowed, no node moves. Writes cannot
// race: each node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/motion_bound/motion_bound.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer parts;  // PartRecord; the nodes come first
layout(std430, binding = 1) readonly buffer Starts {
  vec4 starts[];
};
layout(std430, binding = 2) buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 3) buffer Velocities {
  vec4 velocities[];
};
layout(std430, binding = 4) buffer Shares {
  uint shares[];
};
layout(std430, binding = 5) readonly buffer FaceGroups {
  PairCounts faceCounts;
};
layout(std430, binding = 6) readonly buffer NodeGroups {
  PairCounts nodeCounts;
};
layout(std430, binding = 7) readonly buffer EdgeGroups {
  PairCounts edgeCounts;
};
layout(std430, binding = 8) buffer Report {
  uint report[];  // overflows, shortened motions
};

layout(push_constant) uniform Push {
  NodePush push;
};

void main() {
  if (gl_GlobalInvocationID.x >= push.nodeCount) {
    return;
  }
  uint node = uint(partAt(parts, gl_GlobalInvocationID.x).first);
  bool overflows = faceCounts.count > push.facePairs || nodeCounts.count > push.nodePairs ||
                   edgeCounts.count > push.edgePairs;
  if (gl_GlobalInvocationID.x == 0 && overflows) {
    atomicAdd(report[0], 1u);
  }
  float share = overflows ? 0.0 : uintBitsToFloat(shares[node]);
  shares[node] = floatBitsToUint(1.0);
  if (share >= 1.0) {
    return;
  }
  vec4 here = positions[node];
  vec3 start = starts[node].xyz;
  precise vec3 position = start + share * (here.xyz - start);
  precise vec3 velocity = share * velocities[node].xyz;
  positions[node] = vec4(snapTiny(position), here.w);
  if (here.w > 0.0) {
    velocities[node] = vec4(snapTiny(velocity), 0.0);
  }
  atomicAdd(report[1], 1u);
}
