// SPDX-License-Identifier: MIT
// Moves the nodes of a mesh by the corrections of the coarse nodes around each.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/coarse/move.glsl"

layout(local_size_x_id = 0) in;

vec3 weighted(float coarse, float weight) {
  precise vec3 product = weight * correctionAt(int(coarse));
  return product;
}

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount) {
    return;
  }
  int first = int(push.firstShare + 2 * node);
  vec4 one = texelFetch(shares, first);
  vec4 other = texelFetch(shares, first + 1);
  precise vec3 move = weighted(one.x, one.y);
  move = move + weighted(one.z, one.w);
  move = move + weighted(other.x, other.y);
  move = move + weighted(other.z, other.w);
  moveNode(push.firstNode + node, move);
}
