// SPDX-License-Identifier: MIT
// Copies words from one buffer to another, or fills them with a value: a copy of a recording, as a kernel
// that several recordings share. An invocation moves one word.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/move_words.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer From {
  uint from[];
};
layout(std430, binding = 1) writeonly buffer To {
  uint to[];
};

layout(push_constant) uniform Push {
  MovePush push;
};

void main() {
  uint word = gl_GlobalInvocationID.x;
  if (word < push.words) {
    to[push.to + word] = push.fills != 0 ? push.value : from[push.from + word];
  }
}
