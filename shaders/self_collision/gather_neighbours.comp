// SPDX-License-Identifier: MIT
// Lists whom each ball may touch until lists are made anew: those whose distance now is no more than their
// radii, a quarter more, and what their velocities relative to each other can bring them together. Where
// these are too many, those that are near now.
//
// The order is that of the cells round the ball and, in each, of the nodes. Writes cannot race: each list
// belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/cells.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer rests;   // where a node is at rest; cloth + 1
layout(binding = 2) uniform samplerBuffer sorted;  // position, node
layout(binding = 3) uniform samplerBuffer velocities;
layout(std430, binding = 4) readonly buffer Table {
  uint table[];
};
layout(std430, binding = 5) readonly buffer Starts {
  uint starts[];
};
layout(std430, binding = 6) writeonly buffer Neighbours {
  float neighbours[];
};
layout(std430, binding = 7) buffer Report {
  CrowdReport report;
};

layout(push_constant) uniform Push {
  NeighbourPush push;
};

const float kSlack = 1.25;  // times the sum of two radii

struct Ball {
  vec3 position;
  uint node;
  vec3 velocity;
  vec4 rest;
  float radius;
};

float radiusOf(vec4 rest) {
  return texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * (int(rest.w) - 1) + 4).z;
}

// Whether they may collide, and come near enough to each other; the distance is known.
bool mayTouch(Ball self, uint node, float squared, float aheadSeconds) {
  vec4 rest = texelFetch(rests, int(node));
  float sum = 2.0 * self.radius;
  if (rest.w != self.rest.w) {
    precise float both = self.radius + radiusOf(rest);
    sum = both;
  } else {
    precise vec3 apart = rest.xyz - self.rest.xyz;
    precise float least = push.restFactor * sum;
    if (dotProduct(apart, apart) < least * least) {
      return false;
    }
  }
  precise vec3 relative = texelFetch(velocities, int(node)).xyz - self.velocity;
  precise float speed = max(dotProduct(relative, relative), 1e-20);
  precise float near = kSlack * sum + aheadSeconds * (speed * reciprocalSquareRoot(speed));
  return squared < near * near;
}

// Lists them, and says how many there are, and whether cells were passed over.
uint list(Ball self, uint total, float aheadSeconds, out bool passed) {
  uint words = push.cellCount + push.cellCount / kCellBlock;
  float search = uintBitsToFloat(table[words + kSearchWord]);
  float inverseWidth = uintBitsToFloat(table[words + kCellWord]);
  precise float searchSquared = search * search;
  ivec3 cell = cellOf(self.position, inverseWidth);
  uint first = self.node * kNeighbourStride + 4;
  uint count = 0;
  passed = false;
  for (int row = 0; row < 9; ++row) {
    ivec3 centre = cell + ivec3(0, row % 3 - 1, row / 3 - 1);
    // Three cells along the row: in the table one behind the other, and the first behind the last.
    uint entry = entryOf(centre - ivec3(1, 0, 0), push.cellCount);
    uint last = entry + 3;
    uint at = starts[entry];
    uint end = last <= push.cellCount ? starts[last] : starts[last - push.cellCount] + total;
    if (end - at > kMaxInRow) {
      passed = true;
      end = at;
    }
    while (at < end) {
      vec4 other = texelFetch(sorted, int(at < total ? at : at - total));
      precise vec3 apart = other.xyz - self.position;
      float squared = dotProduct(apart, apart);
      if (squared < searchSquared && uint(other.w) != self.node) {
        // Other cells may share the entries of this row.
        ivec3 where = cellOf(other.xyz, inverseWidth);
        if (where.y == centre.y && where.z == centre.z && abs(where.x - centre.x) <= 1 &&
            mayTouch(self, uint(other.w), squared, aheadSeconds)) {
          if (count < kMaxNeighbours) {
            bool own = texelFetch(rests, int(other.w)).w == self.rest.w;
            neighbours[first + count] = own ? other.w + 1.0 : -other.w - 1.0;
          }
          ++count;
        }
      }
      ++at;
    }
  }
  for (uint i = min(count, kMaxNeighbours); (i & 3u) != 0; ++i) {
    neighbours[first + i] = 0.0;
  }
  return count;
}

void main() {
  uint slot = gl_GlobalInvocationID.x;
  uint total = starts[push.cellCount];
  if (slot >= total) {
    return;
  }
  vec4 place = texelFetch(sorted, int(slot));
  uint node = uint(place.w);
  vec4 rest = texelFetch(rests, int(node));
  vec4 material = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * (int(rest.w) - 1) + 4);
  Ball self = Ball(place.xyz, node, texelFetch(velocities, int(node)).xyz, rest, material.z);
  bool passed;
  uint count = list(self, total, push.aheadSeconds, passed);
  for (bool crowded = count > kMaxNeighbours || passed; crowded; crowded = false) {
    atomicAdd(report.lists, 1u);
    count = list(self, total, 0.0, passed);
  }
  uint head = node * kNeighbourStride;
  neighbours[head] = float(min(count, kMaxNeighbours));
  neighbours[head + 1] = material.z;
  neighbours[head + 2] = material.w;
}
