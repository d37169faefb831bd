// SPDX-License-Identifier: MIT
// Measures the depth of free nodes inside triangle meshes at the tick's end, after measure_penetrations and
// in the same way.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kSolidBinding = 4;
const int kColliderBinding = 5;        // the lists of near colliders are not used
const int kContactImpulseBinding = 7;  // unused: this kernel changes no node

#include "shaders/collision/collide.glsl"
#include "shaders/collision/distance_grid.glsl"
#include "shaders/report/report.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;     // ClothRecord
layout(binding = 1) uniform samplerBuffer blocks;     // ReportBlockRecord
layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 3) buffer Counts {
  uint counts[];
};

layout(push_constant) uniform Push {
  PenetrationPush push;
};

const float kFar = 1e6;  // m

float depthIn(uint number, vec3 position) {
  Collider collider = fetchCollider(number, push.collision, 0.0, 0.0);
  if (!mayTouch(collider, position, position)) {
    return 0.0;
  }
  ColliderFrame frame = fetchFrame(collider, push.collision);
  SolidRecord solid = solidRecordAt(solids, solidTexelOf(frame.shape));
  precise vec3 offset = position - collider.after;
  vec3 p = rotateBack(frame.after, offset);
  if (squaredFromBox(p, solid, 1u, push.collision.progressAfter) > 0.0) {
    return 0.0;
  }
  precise float depth = -nearestPoint(solid, push.collision.progressAfter, p, kFar).distance;
  return depth;
}

void main() {
  const uint kRuns = kReportBlock / kReportDepths;
  uint block = gl_GlobalInvocationID.x / kRuns;
  if (block >= push.blockCount) {
    return;
  }
  ReportBlockRecord place = reportBlockAt(blocks, block);
  uint number = uint(place.cloth);
  ClothRecord cloth = clothAt(cloths, number);
  uint firstNode = firstNodeOf(cloth);
  uint first = uint(place.firstNode);
  uint end = min(first + kReportBlock, nodeCountOf(cloth));
  float depth = 0.0;
  for (uint i = first + gl_GlobalInvocationID.x - block * kRuns; i < end; i += kRuns) {
    vec4 here = texelFetch(positions, int(firstNode + i));
    if (here.w > 0.0) {
      for (uint solid = 0u; solid < push.solidCount; ++solid) {
        depth = max(depth, depthIn(push.collision.colliderCount + solid, here.xyz));
      }
    }
  }
  if (depth > 0.0) {
    atomicMax(counts[number * kReportCounts + kStretchBins], floatBitsToUint(depth));
  }
}
