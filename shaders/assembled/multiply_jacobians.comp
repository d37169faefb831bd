// SPDX-License-Identifier: MIT
// Computes the system matrix  A = J M^-1 J^T + c I,  a product of sparse matrices (SpMM, [Va21] 3.2.2). It
// has an entry for each pair of constraints that share a node. A workgroup handles one chunk; every row
// belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/assembled/rows.glsl"

layout(binding = 3) uniform samplerBuffer entries;  // EntriesRecord by row
layout(binding = 4) uniform samplerBuffer columns;  // NumbersRecord
layout(binding = 5) uniform samplerBuffer sources;  // NumbersRecord: the blocks of each entry
layout(binding = 6) uniform samplerBuffer blocks;   // fill_jacobian.comp
layout(std430, binding = 7) writeonly buffer Values {
  vec4 values[];  // four entries each
};

void multiplyRow(uint row, float compliance) {
  JacobianBlock first = jacobianBlockAt(blocks, 2 * row);
  JacobianBlock second = jacobianBlockAt(blocks, 2 * row + 1);
  precise float diagonal = first.inverseMass * dotProduct(first.gradient, first.gradient) +
                           second.inverseMass * dotProduct(second.gradient, second.gradient) + compliance;
  EntriesRecord range = entriesAt(entries, row);
  int end = int(range.endTexel);
  for (int texel = int(range.firstTexel); texel < end; ++texel) {
    vec4 column = texelFetch(columns, texel);
    vec4 source = texelFetch(sources, texel);
    vec4 value;
    [[unroll]] for (int i = 0; i < 4; ++i) {
      uint made = uint(source[i]);
      JacobianBlock other = jacobianBlockAt(blocks, 2 * uint(column[i]) + (made & 1));
      precise float product =
          other.inverseMass * dotProduct((made & 2) == 0 ? first.gradient : second.gradient, other.gradient);
      value[i] = made < CLOTHSTREAM_DIAGONAL ? product : (made == CLOTHSTREAM_DIAGONAL ? diagonal : 0.0);
    }
    values[texel] = value;
  }
}

void main() {
  AssembledChunkRecord part = assembledChunkAt(chunks, gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  float compliance = clothAt(cloths, system.cloth).scaledCompliance;
  uint lane = self();
  do {
    uint k = 0;
    do {
      uint row = rowAt(system, uint(part.chunk), k, lane);
      if (row < system.endRow) {
        multiplyRow(row, compliance);
      }
      ++k;
    } while (k < kLaneRows);
    lane += width();
  } while (lane < kLanes);
}
