// SPDX-License-Identifier: MIT
// pairs[i] = the first components of texel i of two buffers, for i below the length of the array: the length
// of an array after other members, texels as a parameter, texels that other invocations may write, and the
// number of workgroups in one kernel.
#version 450
layout(local_size_x_id = 0) in;
layout(set = 0, binding = 0) uniform samplerBuffer firsts;
layout(set = 0, binding = 1, rgba32f) uniform coherent readonly imageBuffer seconds;
layout(std430, set = 0, binding = 2) buffer Pairs {
  uint groups;
  vec2 pairs[];
};

float firstOf(samplerBuffer texels, uint i) {
  return texelFetch(texels, int(i)).x;
}

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= uint(pairs.length())) return;
  // Each invocation owns one element. The first one owns the number.
  if (i == 0) groups = gl_NumWorkGroups.x;
  pairs[i] = vec2(firstOf(firsts, i), imageLoad(seconds, int(i)).x);
}
