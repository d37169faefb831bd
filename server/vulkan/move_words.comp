// SPDX-License-Identifier: MIT
// Copies words from one buffer to another, or fills them with a value: a copy of a recording, as a kernel
// that several recordings share. An invocation moves one word.
#version 450

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer From {
  uint from[];
};
layout(std430, binding = 1) writeonly buffer To {
  uint to[];
};

layout(push_constant) uniform Push {
  uint firstFrom, firstTo;  // words
  uint words;
  uint fills;  // not 0: each word becomes `value`
  uint value;
};

void main() {
  uint word = gl_GlobalInvocationID.x;
  if (word < words) {
    to[firstTo + word] = fills != 0 ? value : from[firstFrom + word];
  }
}
