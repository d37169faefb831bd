// SPDX-License-Identifier: MIT
// reciprocalSquareRoot of the floats whose bits are first, first + stride, first + 2 stride, ...
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;
layout(std430, binding = 0) writeonly buffer Results {
  float results[];
};
layout(push_constant) uniform Push {
  uint first;
  uint stride;
};

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < results.length()) {
    results[i] = reciprocalSquareRoot(uintBitsToFloat(first + i * stride));
  }
}
