// SPDX-License-Identifier: MIT
// Push constants of all kernels of codec 2, and vectors of 16-bit components in pairs.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_SLOTS_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_SLOTS_GLSL

#include "shaders/encode/hierarchical/hierarchical.h"

layout(local_size_x_id = 0) in;

layout(push_constant) uniform Push {
  PredictPush push;
};

bool isKey() {
  return push.sinceKey == 0;
}

// A sixteenth of a step is 2^fineBits() units.
int fineBits() {
  return int(push.stepBits) - 4;
}

uint rowAt(uint row, uint slot) {
  return push.vertexCount + 1 + row * push.vertexCount + slot;
}

ivec3 saturate16(ivec3 v) {
  return clamp(v, -32768, 32767);
}

uvec3 pack(ivec3 first, ivec3 second) {
  return (uvec3(first) & 0xFFFFu) | (uvec3(second) << 16);
}
ivec3 firstOf(uvec3 pair) {
  return ivec3(pair << 16) >> 16;
}
ivec3 secondOf(uvec3 pair) {
  return ivec3(pair) >> 16;
}

// True if a difference, in units, is within the promised error
// (proto/codec/hierarchical/hierarchical_encoder.cpp).
bool isPromised(ivec3 difference) {
  int perAxis = (1 << (push.stepBits - 1)) + 1;
  ivec3 d = abs(difference);
  if (any(greaterThan(uvec3(d), uvec3(2 * perAxis)))) {
    return false;
  }
  return d.x * d.x + d.y * d.y + d.z * d.z <= 3 * perAxis * perAxis;
}

bool rests(uvec4 node) {
  return (node.w >> 24) != 0;
}

#endif
