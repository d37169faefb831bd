// SPDX-License-Identifier: MIT
// Codec 3: packs the residuals of positions, first of the coarse vertices, then of the others.
#version 450
#extension GL_GOOGLE_include_directive : require

#define PACKED_COMPONENTS 3
#define PACKED_WORDS kPackedWords
#include "shaders/encode/hierarchical/pack.glsl"

layout(std430, binding = 3) readonly buffer Residuals {
  uint residuals[];  // kResidualRows words per slot; wideResiduals has three more words if they say so
};
layout(std430, binding = 4) readonly buffer WideResiduals {
  int wideResiduals[];
};

uvec2 verticesOf(uint group) {
  uint coarseGroups = (push.coarseVertices + kPackedGroup - 1) / kPackedGroup;
  bool isCoarse = group < coarseGroups;
  uint first = isCoarse ? group * kPackedGroup : push.coarseVertices + (group - coarseGroups) * kPackedGroup;
  return uvec2(first, min(first + kPackedGroup, isCoarse ? push.coarseVertices : push.vertexCount));
}

uint numberOf(uint vertex, uint component) {
  uint along = residuals[vertex], across = residuals[push.vertexCount + vertex];
  uint normal = across & 0xFFFFu;
  if ((across & kSpecialWord) != 0) {
    if ((along | normal) == 0) {
      return component == 0 ? kStayNumber : 0;
    }
    return zigzag(wideResiduals[3 * vertex + (component + 2) % 3]);
  }
  uint word = component == 0 ? normal : component == 1 ? along & 0xFFFFu : along >> 16;
  return zigzag(bitfieldExtract(int(word), 0, 16));
}
