// SPDX-License-Identifier: MIT
// Computes the width of the cells and counts the balls in each. It uses integer atomics, whose order does not
// matter.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/cells.glsl"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer rests;  // RestRecord
layout(binding = 1) uniform samplerBuffer positions;
layout(std430, binding = 2) buffer Table {
  uint table[];
};
layout(std430, binding = 3) writeonly buffer Entries {
  uint entries[];
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

const float kSlack = 0.25;    // share of the reach, for motion that the velocities do not predict
const float kFarthest = 3.0;  // times the reach, the largest search radius
const float kWider = 1.01;    // width of a cell in search radii, because of rounding

uint unordered(uint bits) {
  return (bits & 0x80000000u) != 0 ? bits & 0x7FFFFFFFu : ~bits;
}

// Distance within which balls can meet during the time ahead. kFarthest limits it.
float searchRadius() {
  uint words = push.cellCount + push.cellCount / kCellBlock;
  vec3 box;
  for (int i = 0; i < 3; ++i) {
    precise float side =
        uintBitsToFloat(unordered(table[words + i])) + uintBitsToFloat(unordered(table[words + 3 + i]));
    box[i] = side;
  }
  precise float square = max(dotProduct(box, box), 1e-20);
  precise float radius =
      (1.0 + kSlack) * push.reach + push.aheadSeconds * (square * reciprocalSquareRoot(square));
  precise float farthest = kFarthest * push.reach;
  return radius < farthest ? radius : farthest;
}

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount) {
    return;
  }
  float search = searchRadius();
  float inverseWidth = reciprocal(kWider * search);
  uint blocks = push.cellCount;
  if (node == 0) {
    uint words = push.cellCount + push.cellCount / kCellBlock;
    table[words + kSearchWord] = floatBitsToUint(search);
    table[words + kCellWord] = floatBitsToUint(inverseWidth);
  }
  if (!isBall(restAt(rests, node))) {
    return;
  }
  uint entry = entryOf(cellOf(texelFetch(positions, int(node)).xyz, inverseWidth), push.cellCount);
  entries[node] = entry;
  atomicAdd(table[entry], 1u);
  atomicAdd(table[blocks + entry / kCellBlock], 1u);
}
