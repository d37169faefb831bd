// SPDX-License-Identifier: MIT
// Computes where each cell's balls begin: the exclusive prefix sum of the counts, one invocation per block of
// entries.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/self_collision.h"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) buffer Table {
  uint table[];  // counts before, start of each cell after
};
layout(std430, binding = 1) writeonly buffer Starts {
  uint starts[];  // one more than there are entries
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

// Writes cannot race: each block belongs to one invocation, and the blocks' sums are only read.
void main() {
  uint block = gl_GlobalInvocationID.x;
  uint blocks = push.cellCount / kCellBlock;
  if (block >= blocks) {
    return;
  }
  uint before = 0;
  for (uint i = 0; i < block; ++i) {
    before += table[push.cellCount + i];
  }
  for (uint i = 0; i < kCellBlock; ++i) {
    uint entry = block * kCellBlock + i;
    uint count = table[entry];
    starts[entry] = before;
    table[entry] = before;
    before += count;
  }
  if (block + 1 == blocks) {
    starts[push.cellCount] = before;
  }
}
