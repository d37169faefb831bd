// SPDX-License-Identifier: MIT
// Computes the inner boxes of one level of the tree from their children. Writes cannot race: each box belongs
// to one invocation, and its children are complete.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/motion_bound/motion_bound.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer branches;  // BranchRecord
layout(std430, binding = 1) buffer Boxes {
  vec4 boxes[];
};

layout(push_constant) uniform Push {
  TreePush push;
};

void main() {
  if (gl_GlobalInvocationID.x >= push.count) {
    return;
  }
  BranchRecord branch = branchAt(branches, push.first + gl_GlobalInvocationID.x);
  uint box = uint(branch.box), next = uint(branch.next);
  vec3 low = vec3(1e30), high = vec3(-1e30);
  uint child = box + 1;
  do {
    vec4 childLow = boxes[CLOTHSTREAM_TREE_BOX_TEXELS * child];
    low = min(low, childLow.xyz);
    high = max(high, boxes[CLOTHSTREAM_TREE_BOX_TEXELS * child + 1].xyz);
    child = uint(childLow.w);
  } while (child < next);
  boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box] = vec4(low, branch.next);
  boxes[CLOTHSTREAM_TREE_BOX_TEXELS * box + 1] = vec4(high, -1.0);
}
