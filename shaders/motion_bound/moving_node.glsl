// SPDX-License-Identifier: MIT
// A node at the substep's start, and how far it may move.
//
// The including kernel defines kStartBinding, the first of two bindings.
#ifndef CLOTHSTREAM_SHADERS_MOTION_BOUND_MOVING_NODE_GLSL
#define CLOTHSTREAM_SHADERS_MOTION_BOUND_MOVING_NODE_GLSL

#include "shaders/motion_bound/motion_bound.h"
#include "shaders/shared/arithmetic.glsl"

layout(binding = kStartBinding) uniform samplerBuffer starts;    // positions at the substep's start
layout(binding = kStartBinding + 1) uniform samplerBuffer ends;  // and at its end

struct Moving {
  vec3 at;
  float way;  // m, at least the length of its motion before slide_nodes.comp
};

Moving movingNode(uint node) {
  vec3 from = texelFetch(starts, int(node)).xyz;
  precise vec3 motion = texelFetch(ends, int(node)).xyz - from;
  precise float squared = max(dotProduct(motion, motion), 1e-20);
  precise float way = 1.001 * (squared * reciprocalSquareRoot(squared));
  return Moving(from, way);
}

#endif
