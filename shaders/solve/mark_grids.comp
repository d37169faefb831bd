// SPDX-License-Identifier: MIT
// Marks the springs of grids that ACAD held last, each at the node that owns it, from the weights that
// prepare_grids.comp has computed. A workgroup handles one chunk.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer along;  // SpringWeights
layout(std430, binding = 4) readonly buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 5) buffer Marks {
  uint marks[];
};

layout(push_constant) uniform Push {
  MarkPush push;
};

uint markOf(uint node, uint column) {
  SpringWeights own = springWeightsAt(along, node);
  // The left neighbour has the weight of the spring to the left below.
  SpringWeights left = springWeightsAt(along, column > 0 ? node - 1 : node);
  return (own.right > 0.0 ? 1u : 0u) | (own.below > 0.0 ? 2u : 0u) | (own.rightBelow > 0.0 ? 4u : 0u) |
         (column > 0 && left.rightToBelow > 0.0 ? 8u : 0u) | (own.secondRight > 0.0 ? 16u : 0u) |
         (own.secondBelow > 0.0 ? 32u : 0u);
}

void main() {
  ChunkRecord part = chunkAt(chunks, push.firstChunk + gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  // Without an active spring the weights are those of an earlier substep.
  bool any = solves[system.number].constraints > 0;
  uint lane = self();
  do {
    Walk walk = walkAt(system, uint(part.chunk) * kLanes + lane);
    uint k = 0;
    do {
      uint node = walk.first + min(k, max(walk.count, 1) - 1) * walk.step;
      uint mark = markOf(node, walk.column);
      if (any && k < walk.count) {
        marks[node] = mark;
      }
      ++k;
    } while (k < kWalk);
    lane += width();
  } while (lane < kLanes);
}
