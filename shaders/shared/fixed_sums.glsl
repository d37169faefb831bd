// SPDX-License-Identifier: MIT
// Sums over a workgroup: kLanes fixed lanes, then a fixed tree. The bits do not depend on the workgroup's
// size.
#ifndef CLOTHSTREAM_SHADERS_SHARED_FIXED_SUMS_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_FIXED_SUMS_GLSL

#include "shaders/shared/simulation.h"

// This declaration must precede every use of gl_WorkGroupSize, which would be 1 otherwise.
layout(local_size_x_id = 0) in;

const uint kLanes = CLOTHSTREAM_SOLVE_LANES;

shared vec2 lanes[kLanes];

uint self() {
  return gl_LocalInvocationID.x;
}
uint width() {
  return gl_WorkGroupSize.x;
}

// Sum of all lanes. Any invocation may have written a lane; every invocation gets the sum.
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
