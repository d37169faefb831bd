// SPDX-License-Identifier: MIT
// Which colliders each run of nodes may touch during a tick: an invocation a run, a collider after the other.
//
// The list is good for a box: where the nodes are, where their velocities take them with half as much
// to spare, and as far as the fastest collider that is near could push them. A node that leaves the box all
// the same is tried against every collider, so that no choice made here can be seen in the state. Writes
// cannot race: each list belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/collision/collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer positions;
layout(binding = 1) uniform samplerBuffer velocities;
layout(binding = 2) uniform samplerBuffer bounds;  // ColliderBounds of groups, then of colliders
layout(std430, binding = 3) writeonly buffer Near {
  float near[];
};

layout(push_constant) uniform Push {
  GatherPush push;
};

const float kAhead = 1.5;      // of the way that a velocity goes in a tick
const float kSlack = 0.01;     // m
const float kRounding = 2e-3;  // m: far above the rounding of any place in the world

struct Box {
  vec3 low;
  vec3 high;
};

Box boxOf(uint first, uint end) {
  Box box = Box(vec3(1e30), vec3(-1e30));
  float ahead = kAhead * push.tickSeconds;
  for (uint node = first; node < end; ++node) {
    vec3 here = texelFetch(positions, int(node)).xyz;
    precise vec3 there = here + ahead * texelFetch(velocities, int(node)).xyz;
    box.low = min(box.low, min(here, there));
    box.high = max(box.high, max(here, there));
  }
  box.low -= kSlack;
  box.high += kSlack;
  return box;
}

// How far the collider or group goes at most if its box comes within `reach` of the other; else negative.
float wayWhereNear(uint index, Box box, float reach) {
  vec4 low = texelFetch(bounds, int(2 * index));
  vec4 high = texelFetch(bounds, int(2 * index + 1));
  bool overlaps =
      all(lessThanEqual(low.xyz - reach, box.high)) && all(greaterThanEqual(high.xyz + reach, box.low));
  return overlaps ? low.w : -1.0;
}

// Lists them, and says how many there are and how far one of them goes.
uint list(uint first, Box box, float reach, out float way) {
  uint groups = (push.colliderCount + kColliderGroup - 1) / kColliderGroup;
  uint count = 0;
  way = 0.0;
  for (uint group = 0; group < groups; ++group) {
    if (wayWhereNear(group, box, reach) >= 0.0) {
      uint end = min((group + 1) * kColliderGroup, push.colliderCount);
      for (uint collider = group * kColliderGroup; collider < end; ++collider) {
        float own = wayWhereNear(groups + collider, box, reach);
        if (own >= 0.0) {
          way = max(way, own);
          if (count < kMaxNear) {
            near[first + 8 + count] = float(collider);
          }
          ++count;
        }
      }
    }
  }
  return count;
}

void main() {
  uint run = gl_GlobalInvocationID.x;
  if (run * kNearNodes >= push.nodeCount) {
    return;
  }
  uint first = run * kNearStride;
  float reach = kThicknessReach * push.thickness + kRounding;
  Box box = boxOf(run * kNearNodes, min((run + 1) * kNearNodes, push.nodeCount));
  float way;
  uint count = list(first, box, reach, way);
  if (way > kSlack) {
    box.low -= kAhead * way;
    box.high += kAhead * way;
    count = list(first, box, reach, way);
  }
  near[first] = box.low.x;
  near[first + 1] = box.low.y;
  near[first + 2] = box.low.z;
  near[first + 3] = float(count);
  near[first + 4] = box.high.x;
  near[first + 5] = box.high.y;
  near[first + 6] = box.high.z;
}
