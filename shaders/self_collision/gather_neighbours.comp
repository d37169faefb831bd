// SPDX-License-Identifier: MIT
// Lists the balls that each ball may touch until the next search. Their distance is at most 1.25 times the
// sum of the radii, plus the way that their relative velocity brings them together. If these are too many,
// only those that are near now are listed.
//
// The list is in the order of the cells around the ball and, within a cell, of the nodes. A search ends when
// the list is more than full. Writes cannot race: each list belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/self_collision/cells.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer rests;   // RestRecord
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
  RestRecord rest;
  float radius;
};

float radiusOf(RestRecord rest) {
  return clothAt(cloths, clothOf(rest)).ballRadius;
}

// True if two balls at a known squared distance may collide and come near enough to each other.
bool mayTouch(Ball self, uint node, float squared, float aheadSeconds) {
  RestRecord rest = restAt(rests, node);
  float sum = 2.0 * self.radius;
  if (rest.clothNumber != self.rest.clothNumber) {
    precise float both = self.radius + radiusOf(rest);
    sum = both;
  } else {
    precise vec3 apart = rest.position - self.rest.position;
    precise float least = push.restFactor * sum;
    precise float leastSquared = least * least;
    if (dotProduct(apart, apart) < leastSquared) {
      return false;
    }
  }
  precise vec3 relative = texelFetch(velocities, int(node)).xyz - self.velocity;
  precise float speed = max(dotProduct(relative, relative), 1e-20);
  precise float near = kSlack * sum + aheadSeconds * (speed * reciprocalSquareRoot(speed));
  precise float nearSquared = near * near;
  return squared < nearSquared;
}

// Lists the neighbours and returns their number, at most kMaxNeighbours + 1. `passed` says whether cells were
// skipped before.
uint list(Ball self, uint total, float aheadSeconds, out bool passed) {
  uint words = push.cellCount + push.cellCount / kCellBlock;
  float search = uintBitsToFloat(table[words + kSearchWord]);
  float inverseWidth = uintBitsToFloat(table[words + kCellWord]);
  precise float searchSquared = search * search;
  ivec3 cell = cellOf(self.position, inverseWidth);
  uint first = self.node * kNeighbourStride + kNeighbourHead;
  uint count = 0;
  passed = false;
  for (int row = 0; row < 9 && count <= kMaxNeighbours; ++row) {
    ivec3 centre = cell + ivec3(0, row % 3 - 1, row / 3 - 1);
    // Three cells along the row are consecutive in the table, which wraps round.
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
            bool own = restAt(rests, uint(other.w)).clothNumber == self.rest.clothNumber;
            precise float number = other.w + 1.0;
            precise float signedNumber = own ? number : -number;
            neighbours[first + count] = signedNumber;
          }
          ++count;
        }
      }
      at = count > kMaxNeighbours ? end : at + 1;
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
  RestRecord rest = restAt(rests, node);
  ClothRecord cloth = clothAt(cloths, clothOf(rest));
  Ball self = Ball(place.xyz, node, texelFetch(velocities, int(node)).xyz, rest, cloth.ballRadius);
  bool passed;
  uint count = list(self, total, push.aheadSeconds, passed);
  for (bool crowded = count > kMaxNeighbours || passed; crowded; crowded = false) {
    atomicAdd(report.lists, 1u);
    count = list(self, total, 0.0, passed);
  }
  uint head = node * kNeighbourStride;  // NeighbourHead
  neighbours[head] = float(min(count, kMaxNeighbours));
  neighbours[head + 1] = cloth.ballRadius;
  neighbours[head + 2] = cloth.ballFriction;
}
