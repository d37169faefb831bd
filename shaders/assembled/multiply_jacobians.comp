// SPDX-License-Identifier: MIT
// The system matrix  A = J M^-1 J^T + c I,  a product of sparse matrices (SpMM, [Va21] 3.2.2) whose entries
// are known to lie where two constraints share a node. One chunk a workgroup; every row belongs to one
// invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/rows.glsl"

layout(binding = 3) uniform samplerBuffer entries;  // EntriesRecord, a row
layout(binding = 4) uniform samplerBuffer columns;  // NumbersRecord
layout(binding = 5) uniform samplerBuffer sources;  // NumbersRecord: what entries are made of
layout(binding = 6) uniform samplerBuffer blocks;   // fill_jacobian.comp
layout(std430, binding = 7) writeonly buffer Values {
  vec4 values[];  // of four entries
};

void multiplyRow(uint row, float compliance) {
  vec4 first = texelFetch(blocks, int(2 * row));
  vec4 second = texelFetch(blocks, int(2 * row + 1));
  precise float diagonal =
      first.w * dotProduct(first.xyz, first.xyz) + second.w * dotProduct(second.xyz, second.xyz) + compliance;
  vec4 range = texelFetch(entries, int(row));
  int end = int(range.y);
  for (int texel = int(range.x); texel < end; ++texel) {
    vec4 column = texelFetch(columns, texel);
    vec4 source = texelFetch(sources, texel);
    vec4 value;
    [[unroll]] for (int i = 0; i < 4; ++i) {
      uint made = uint(source[i]);
      vec4 other = texelFetch(blocks, int(2 * uint(column[i]) + (made & 1)));
      precise float product = other.w * dotProduct((made & 2) == 0 ? first.xyz : second.xyz, other.xyz);
      value[i] = made < CLOTHSTREAM_DIAGONAL ? product : (made == CLOTHSTREAM_DIAGONAL ? diagonal : 0.0);
    }
    values[texel] = value;
  }
}

void main() {
  vec4 part = texelFetch(chunks, int(gl_WorkGroupID.x));
  System system = systemAt(uint(part.x));
  float compliance = texelFetch(cloths, system.cloth + 5).x;
  uint lane = self();
  do {
    uint k = 0;
    do {
      uint row = rowAt(system, uint(part.y), k, lane);
      if (row < system.endRow) {
        multiplyRow(row, compliance);
      }
      ++k;
    } while (k < kLaneRows);
    lane += width();
  } while (lane < kLanes);
}
