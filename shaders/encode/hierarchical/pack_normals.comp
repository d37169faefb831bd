// SPDX-License-Identifier: MIT
// Codec 3: packs the residuals of normals.
#version 450
#extension GL_GOOGLE_include_directive : require

#define PACKED_COMPONENTS 2
#define PACKED_WORDS kPackedNormalWords
#include "shaders/encode/hierarchical/pack.glsl"

layout(std430, binding = 3) readonly buffer NormalResiduals {
  uint normalResiduals[];  // by vertex: residuals of u and v, one byte each
};

uvec2 verticesOf(uint group) {
  uint first = group * kPackedGroup;
  return uvec2(first, min(first + kPackedGroup, push.vertexCount));
}

uint numberOf(uint vertex, uint component) {
  return zigzag(bitfieldExtract(int(normalResiduals[vertex]), int(8 * component), 8));
}
