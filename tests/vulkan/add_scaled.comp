// SPDX-License-Identifier: MIT
// values[i] += scale * i + offset, for i below count: specialisation, push constants and storage in one
// kernel.
#version 450
layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kScale = 0;
layout(constant_id = 2) const float kOffset = 0;
layout(push_constant) uniform Push {
  uint count;
  float factor;
};
layout(set = 0, binding = 0) buffer Values {
  float values[];
};

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  // Each invocation owns one element.
  values[i] += factor * (float(kScale * i) + kOffset);
}
