// SPDX-License-Identifier: MIT
// Completes the records with the curvature around each vertex after all vertices are placed. It also updates
// the weights that the frame leaves, and computes the frame's hash.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/hierarchical/slots.glsl"
#include "shaders/encode/reconstruction_hash.glsl"

layout(std430, binding = 0) readonly buffer Links {
  uvec4 links[];
};
layout(std430, binding = 1) readonly buffer Past {
  uvec4 past[];
};
layout(std430, binding = 2) buffer Made {
  uvec4 made[];
};
layout(std430, binding = 3) readonly buffer SlotTable {
  uint slotTable[];  // the first row has the vertices
};
layout(std430, binding = 4) buffer Status {
  SlotStatus status;
};
layout(std430, binding = 5) buffer ClassWeights {
  int weights[kAllWeights];
};

layout(std430, binding = 6) readonly buffer SentNormals {
  uint sentNormals[];  // by vertex; 0 if the stream has no normals
};

shared uint hashLow;
shared uint hashHigh;

void finishRecord(uint slot) {
  uvec4 nearest = links[kLinkNearest * push.vertexCount + slot];
  uvec4 node = made[slot];
  uvec4 sum = made[nearest.x] + made[nearest.y] + made[nearest.z] + made[nearest.w];
  ivec3 curvature = saturate16(ivec3(sum.xyz - 4 * node.xyz) >> fineBits());
  ivec3 before = isKey() ? curvature : firstOf(past[rowAt(kRowCurvature, slot)].xyz);
  made[rowAt(kRowCurvature, slot)] = uvec4(pack(curvature, before), sum.w + 4 * node.w);
}

// Writes cannot race: one invocation per slot, and one per weight; nodes are only read. The workgroup adds up
// in shared memory first.
void main() {
  if (gl_LocalInvocationIndex == 0) {
    hashLow = 0;
    hashHigh = 0;
  }
  barrier();
  uint slot = gl_GlobalInvocationID.x;
  if (slot < push.vertexCount) {
    finishRecord(slot);
    ivec3 position = ivec3(made[slot].xyz);
    uint vertex = slotTable[slot];
    uint normal = sentNormals[vertex];
    atomicAdd(hashLow, hashWord(vertex, position, normal, kLowSeed));
    atomicAdd(hashHigh, hashWord(vertex, position, normal, kHighSeed));
  }
  // A frame at rest leaves the weights that it found.
  if (slot < kClassWeights && push.hasWeights != 0 && (isKey() || status.moved != 0)) {
    weights[kKeptWeights + slot] = weights[kLeftWeights + slot];
  }
  barrier();
  if (gl_LocalInvocationIndex == 0) {
    atomicAdd(status.hashLow, hashLow);
    atomicAdd(status.hashHigh, hashHigh);
  }
}
