// SPDX-License-Identifier: MIT
// Marks the springs of grids that solve_stretched.comp held last, each at the node that owns it. A workgroup
// handles as many listed nodes as a chunk has nodes.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/linear_system.glsl"
#include "shaders/solve/stretched_tables.glsl"

layout(binding = 3) uniform samplerBuffer vectors;
layout(binding = 4) uniform samplerBuffer springs;  // solve_stretched.comp
layout(std430, binding = 5) readonly buffer Lists {
  uint lists[];
};
layout(std430, binding = 6) readonly buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 7) buffer Marks {
  uint marks[];
};

layout(push_constant) uniform Push {
  MarkPush push;
};

// Bit of the spring between two nodes, numbered from the cloth's first one; 0 if `other` owns it.
uint bitOf(uint node, uint other, uint columns) {
  int rows = int(other / columns) - int(node / columns);
  int right = int(other % columns) - int(node % columns);
  uint below = rows == 2 ? 32u : (right == 0 ? 2u : (right == 1 ? 4u : 8u));
  uint same = right == 1 ? 1u : (right == 2 ? 16u : 0u);
  return rows > 0 ? below : (rows == 0 ? same : 0u);
}

// Node that was listed at a place, numbered from the cloth's first one.
uint nodeAt(System system, uint place) {
  return lists[kNodes * push.nodes + system.firstNode + place];
}

uint markOf(System system, uint place) {
  const uint kTexels = kBend ? 6 : 4;
  uint node = nodeAt(system, place);
  int first = int(system.firstNode + place);
  uint count = uint(texelFetch(vectors, int(kPlaces * push.nodes) + first).w);
  uint mark = 0;
  [[unroll]] for (uint texel = 0; texel < kTexels; ++texel) {
    bool exists = texel < count;
    vec4 two = texelFetch(springs, int((exists ? texel : 0) * push.nodes) + first);
    mark |= exists && two.x > 0.0 ? bitOf(node, nodeAt(system, uint(two.y)), system.columns) : 0u;
    mark |= exists && two.z > 0.0 ? bitOf(node, nodeAt(system, uint(two.w)), system.columns) : 0u;
  }
  return mark;
}

void main() {
  ChunkRecord part = chunkAt(chunks, push.firstChunk + gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  uint listed = lists[kTables * push.nodes + kHead * system.number + 1];
  uint count = solves[system.number].constraints > 0 ? listed : 0;
  uint i = self();
  do {
    uint place = uint(part.chunk) * kLanes * kWalk + i;
    if (place < count) {
      marks[system.firstNode + nodeAt(system, place)] = markOf(system, place);
    }
    i += width();
  } while (i < kLanes * kWalk);
}
