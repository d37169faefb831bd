// SPDX-License-Identifier: MIT
// Sums over a workgroup whose bits do not depend on its size: kLanes fixed lanes, then a fixed tree.
#ifndef CLOTHSTREAM_SHADERS_SHARED_FIXED_SUMS_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_FIXED_SUMS_GLSL

#include "shaders/shared/simulation.h"

// Before gl_WorkGroupSize is used, or it would be 1.
layout(local_size_x_id = 0) in;

const uint kLanes = CLOTHSTREAM_SOLVE_LANES;

shared vec2 lanes[kLanes];

uint self() {
  return gl_LocalInvocationID.x;
}
uint width() {
  return gl_WorkGroupSize.x;
}

// Of the lanes, written by whoever; every invocation gets it.
vec2 sumOfLanes() {
  barrier();
  for (uint half_ = kLanes / 2; half_ > 0; half_ /= 2) {
    for (uint lane = self(); lane < half_; lane += width()) {
      precise vec2 sum = lanes[lane] + lanes[lane + half_];
      lanes[lane] = sum;
    }
    barrier();
  }
  vec2 sum = lanes[0];
  barrier();
  return sum;
}

#endif
