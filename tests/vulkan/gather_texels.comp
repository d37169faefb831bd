// SPDX-License-Identifier: MIT
// sums[i] = the sum of the components of texel (i + 1) mod count.
#version 450
layout(local_size_x_id = 0) in;
layout(push_constant) uniform Push {
  uint count;
};
layout(set = 0, binding = 0) uniform samplerBuffer texels;
layout(set = 0, binding = 1) writeonly buffer Sums {
  float sums[];
};

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  // Each invocation owns one element.
  const vec4 texel = texelFetch(texels, int((i + 1) % count));
  sums[i] = texel.x + texel.y + texel.z + texel.w;
}
