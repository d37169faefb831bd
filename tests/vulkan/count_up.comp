// SPDX-License-Identifier: MIT
// to[i] = from[(i + 1) mod count] + 1: reads what other workgroups wrote before, so that a missing barrier
// matters.
#version 450
layout(local_size_x_id = 0) in;
layout(push_constant) uniform Push {
  uint count;
};
layout(set = 0, binding = 0) readonly buffer From {
  uint from[];
};
layout(set = 0, binding = 1) writeonly buffer To {
  uint to[];
};

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  // Each invocation owns one element of `to`, and `from` is another buffer.
  to[i] = from[(i + 1) % count] + 1;
}
