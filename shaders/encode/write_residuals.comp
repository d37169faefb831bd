// SPDX-License-Identifier: MIT
// Residuals of the cheapest prediction as planes of bytes, as in proto/codec/lattice/residual_planes.h.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/encode/prediction.glsl"

// 64 bytes that take the status, four planes of positions, the plane of normals; each from a word's start.
layout(std430, binding = 4) writeonly buffer Packed {
  uint packed_[];
};

const uint kStatusWords = 16;

shared uint usedBits;

uint cheapest(uint costs[kPredictionCount]) {
  uint count = push.predicted != 0 ? kPredictionCount : kTemporal;
  uint best = 0;
  for (uint p = 1; p < count; ++p) {
    best = costs[p] < costs[best] ? p : best;
  }
  return best;
}

// Returns the bits that the word's residuals use.
uint writePositions(uint word, uint wordsPerPlane) {
  uint prediction = cheapest(status.positionCosts);
  uvec4 planes = uvec4(0);
  uint used = 0;
  for (uint byte = 0; byte < 4; ++byte) {
    uint at = 4 * word + byte;
    if (at < kPositionChannels * push.vertexCount) {
      uint channel = at < push.vertexCount ? 0 : (at < 2 * push.vertexCount ? 1 : 2);
      uint bits = zigzag(residual(channel, at - channel * push.vertexCount, prediction));
      used |= bits;
      planes |= ((uvec4(bits) >> uvec4(0, 8, 16, 24)) & 0xFFu) << (8 * byte);
    }
  }
  for (uint plane = 0; plane < 4; ++plane) {
    packed_[kStatusWords + plane * wordsPerPlane + word] = planes[plane];
  }
  return used;
}

void writeNormals(uint word, uint start) {
  uint prediction = cheapest(status.normalCosts);
  uint plane = 0;
  for (uint byte = 0; byte < 4; ++byte) {
    uint at = 4 * word + byte;
    if (at < 2 * push.vertexCount) {
      uint channel = kPositionChannels + (at < push.vertexCount ? 0 : 1);
      uint vertex = at < push.vertexCount ? at : at - push.vertexCount;
      plane |= (zigzag(residual(channel, vertex, prediction)) & 0xFFu) << (8 * byte);
    }
  }
  packed_[start + word] = plane;
}

// Writes cannot race: one invocation a word.
void main() {
  if (gl_LocalInvocationIndex == 0) {
    usedBits = 0;
  }
  barrier();
  uint word = gl_GlobalInvocationID.x;
  uint positionWords = (kPositionChannels * push.vertexCount + 3) / 4;
  uint normalWords = kHasNormals != 0 ? (2 * push.vertexCount + 3) / 4 : 0;
  if (word < positionWords) {
    atomicOr(usedBits, writePositions(word, positionWords));
  } else if (word < positionWords + normalWords) {
    writeNormals(word - positionWords, kStatusWords + 4 * positionWords);
  }
  barrier();
  if (gl_LocalInvocationIndex == 0) {
    atomicOr(status.residualBits, usedBits);
  }
}
