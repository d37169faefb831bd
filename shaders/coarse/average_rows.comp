// SPDX-License-Identifier: MIT
// Sums, for each row of a grid and each coarse column, the nodes of the row with the weights of the coarse
// column. hold_links.comp adds the sums of the rows.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/coarse/coarse.h"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer positions;
layout(std430, binding = 1) writeonly buffer Parts {
  vec4 parts[];  // w: sum of the weights
};

layout(push_constant) uniform Push {
  CoarsePush push;
};

// Writes cannot race: each sum belongs to one invocation.
void main() {
  uint invocation = gl_GlobalInvocationID.x;
  if (invocation >= push.rows * push.coarseColumns) {
    return;
  }
  uint row = invocation / push.coarseColumns;
  CoarseHat hat = coarseHat(invocation - row * push.coarseColumns, push.coarseColumns, push.stride,
                            push.columns, push.inverseStride, push.inverseLastColumns);
  precise vec3 sum = vec3(0.0);
  precise float weights = 0.0;
  for (uint column = hat.first; column <= hat.last; ++column) {
    float weight = coarseWeight(hat, column);
    sum = sum + weight * texelFetch(positions, int(push.firstNode + row * push.columns + column)).xyz;
    weights = weights + weight;
  }
  parts[push.firstPart + invocation] = vec4(sum, weights);
}
