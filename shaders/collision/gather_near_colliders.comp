// SPDX-License-Identifier: MIT
// Lists the colliders that each run of nodes may touch during a tick. One invocation handles one run.
//
// The list is valid within a box. The box contains the positions of the nodes, 1.5 times the way of their
// velocities, and the distance that the fastest near collider could push them. A node that leaves the box is
// tested against every collider, so that the state does not depend on the choices made here. Writes cannot
// race: each list belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/collision/collision.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer positions;
layout(binding = 1) uniform samplerBuffer velocities;
layout(binding = 2) uniform samplerBuffer bounds;  // ColliderBounds of the groups, then of the colliders
layout(std430, binding = 3) writeonly buffer Near {
  float near[];
};

layout(push_constant) uniform Push {
  GatherPush push;
};

const float kAhead = 1.5;      // times the way of a velocity in a tick
const float kSlack = 0.01;     // m
const float kRounding = 2e-3;  // m, far above the rounding of any position in the world

struct Box {
  vec3 low;
  vec3 high;
};

Box widened(Box box, float margin) {
  precise vec3 low = box.low - margin;
  precise vec3 high = box.high + margin;
  return Box(low, high);
}

Box boxOf(uint first, uint end) {
  Box box = Box(vec3(1e30), vec3(-1e30));
  precise float ahead = kAhead * push.tickSeconds;
  for (uint node = first; node < end; ++node) {
    vec3 here = texelFetch(positions, int(node)).xyz;
    precise vec3 there = here + ahead * texelFetch(velocities, int(node)).xyz;
    box.low = min(box.low, min(here, there));
    box.high = max(box.high, max(here, there));
  }
  return widened(box, kSlack);
}

// Largest motion of a collider or group whose box comes within `reach` of `box`; negative if the box is
// farther away.
float motionIfNear(uint index, Box box, float reach) {
  ColliderBounds other = colliderBoundsAt(bounds, index);
  precise vec3 low = other.low - reach;
  precise vec3 high = other.high + reach;
  bool overlaps = all(lessThanEqual(low, box.high)) && all(greaterThanEqual(high, box.low));
  return overlaps ? other.farthestMotion : -1.0;
}

// Lists the near colliders. Returns their number and the largest of their motions.
uint list(uint first, Box box, float reach, out float way) {
  uint groups = (push.colliderCount + kColliderGroup - 1) / kColliderGroup;
  uint count = 0;
  way = 0.0;
  for (uint group = 0; group < groups; ++group) {
    if (motionIfNear(group, box, reach) >= 0.0) {
      uint end = min((group + 1) * kColliderGroup, push.colliderCount);
      for (uint collider = group * kColliderGroup; collider < end; ++collider) {
        float own = motionIfNear(groups + collider, box, reach);
        if (own >= 0.0) {
          way = max(way, own);
          if (count < kMaxNear) {
            near[first + kNearHeader + count] = float(collider);
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
  precise float reach = kThicknessReach * push.thickness + kRounding;
  Box box = boxOf(run * kNearNodes, min((run + 1) * kNearNodes, push.nodeCount));
  float way;
  uint count = list(first, box, reach, way);
  if (way > kSlack) {
    precise float margin = kAhead * way;
    box = widened(box, margin);
    count = list(first, box, reach, way);
  }
  for (uint axis = 0; axis < 3; ++axis) {
    near[first + kNearLow + axis] = box.low[axis];
    near[first + kNearHigh + axis] = box.high[axis];
  }
  near[first + kNearCount] = float(count);
}
