// SPDX-License-Identifier: MIT
// Copies texels in the way that the simulation reads and writes its state: a lower bound for its time.
#version 450

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer source;
layout(std430, binding = 1) writeonly buffer Target {
  vec4 target[];
};

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= target.length()) {
    return;
  }
  target[i] = texelFetch(source, int(i));
}
