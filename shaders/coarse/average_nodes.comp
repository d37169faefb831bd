// SPDX-License-Identifier: MIT
// Sums a part of the nodes whose weighted mean is a coarse node of a mesh. The parts make the kernel
// parallel, and their fixed number the sums the same for every workgroup size.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/coarse/coarse.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer coarseNodes;  // CoarseNodeRecord
layout(binding = 1) uniform samplerBuffer means;        // two CoarseShare per texel
layout(binding = 2) uniform samplerBuffer positions;    // w: inverse mass
layout(std430, binding = 3) writeonly buffer Parts {
  vec4 parts[];  // of each coarse node
};

layout(push_constant) uniform Push {
  CoarsePush push;
};

vec3 weighted(float node, float weight) {
  precise vec3 product = weight * texelFetch(positions, int(node)).xyz;
  return product;
}

// Writes cannot race: each part belongs to one invocation.
void main() {
  uint invocation = gl_GlobalInvocationID.x;
  if (invocation >= push.coarseCount * push.parts) {
    return;
  }
  CoarseNodeRecord coarse = coarseNodeAt(coarseNodes, push.firstCoarse + invocation / push.parts);
  int first = int(wholeNumber(coarse.firstLow, coarse.firstHigh));
  int end = first + int(coarse.count);
  precise vec3 sum = vec3(0.0);
  for (int i = first + int(invocation % push.parts); i < end; i += int(push.parts)) {
    vec4 two = texelFetch(means, i);
    sum = sum + weighted(two.x, two.y);
    sum = sum + weighted(two.z, two.w);
  }
  parts[push.firstPart + invocation] = vec4(sum, 0.0);
}
