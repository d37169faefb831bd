// SPDX-License-Identifier: MIT
// Positions and normals to integers (proto/codec/lattice/lattice.h, octahedral.h), and the hash of them.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/frame.h"
#include "shaders/encode/reconstruction_hash.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kHasNormals = 0;

layout(binding = 0) uniform samplerBuffer positions;
layout(binding = 1) uniform samplerBuffer normals;
// Channel after channel: x, y, z, and u, v where there are normals.
layout(std430, binding = 2) writeonly buffer Lattice {
  int lattice[];
};
layout(std430, binding = 3) buffer Status {
  FrameStatus status;
};

layout(push_constant) uniform Push {
  EncodePush push;
};

const float kLatticeLimit = 8388608.0;
const float kOne = 32768.0;
const int kOctahedralLimit = 127;

shared uint hashLow;
shared uint hashHigh;

// Written so that what is not a number goes to the lower limit.
int clampToInteger(float q, float limit) {
  float low = q >= -limit ? q : -limit;
  return int(low > limit ? limit : low);
}

int quantise(float x) {
  precise float q = floor(x * push.inverseStep + 0.5);
  precise float error = x - q * push.step;
  precise float halfStep = push.step * 0.5;
  precise float moved = error > halfStep ? q + 1.0 : (error < -halfStep ? q - 1.0 : q);
  return clampToInteger(moved, kLatticeLimit);
}

int fixedPoint(float x) {
  precise float q = floor(x * kOne + 0.5);
  return clampToInteger(q, kOne);
}

int octahedralComponent(int magnitude, int sum, int signedBy) {
  int rounded = (2 * kOctahedralLimit * magnitude + sum) / (2 * sum);
  return signedBy < 0 ? -rounded : rounded;
}

ivec2 encodeOctahedral(vec3 normal) {
  ivec3 n = ivec3(fixedPoint(normal.x), fixedPoint(normal.y), fixedPoint(normal.z));
  ivec3 a = abs(n);
  int sum = a.x + a.y + a.z;
  if (sum == 0) {
    return ivec2(0);
  }
  ivec2 magnitude = n.z < 0 ? ivec2(sum - a.y, sum - a.x) : a.xy;
  return ivec2(octahedralComponent(magnitude.x, sum, n.x), octahedralComponent(magnitude.y, sum, n.y));
}

// Writes cannot race: each invocation takes every stride-th vertex. The workgroup adds up in shared memory
// first.
void main() {
  if (gl_LocalInvocationIndex == 0) {
    hashLow = 0;
    hashHigh = 0;
  }
  barrier();
  uint low = 0;
  uint high = 0;
  uint stride = gl_NumWorkGroups.x * gl_WorkGroupSize.x;
  for (uint vertex = gl_GlobalInvocationID.x; vertex < push.vertexCount; vertex += stride) {
    vec3 p = texelFetch(positions, int(vertex)).xyz;
    ivec3 q = ivec3(quantise(p.x), quantise(p.y), quantise(p.z));
    lattice[vertex] = q.x;
    lattice[push.vertexCount + vertex] = q.y;
    lattice[2 * push.vertexCount + vertex] = q.z;
    uint normal = 0;
    if (kHasNormals != 0) {
      ivec2 uv = encodeOctahedral(texelFetch(normals, int(vertex)).xyz);
      lattice[3 * push.vertexCount + vertex] = uv.x;
      lattice[4 * push.vertexCount + vertex] = uv.y;
      normal = (uint(uv.x) & 0xFFu) | ((uint(uv.y) & 0xFFu) << 8);
    }
    low += hashWord(vertex, q, normal, kLowSeed);
    high += hashWord(vertex, q, normal, kHighSeed);
  }
  atomicAdd(hashLow, low);
  atomicAdd(hashHigh, high);
  barrier();
  if (gl_LocalInvocationIndex == 0) {
    atomicAdd(status.hashLow, hashLow);
    atomicAdd(status.hashHigh, hashHigh);
  }
}
