// SPDX-License-Identifier: MIT
// Measures the depth of free nodes inside colliders at the tick's end; an invocation handles kReportDepths
// nodes. The deepest node of a cloth follows from an atomic maximum of the depths' bits, which order as the
// depths do. The order of the invocations does not matter.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 4;
const int kContactImpulseBinding = 6;  // unused: this kernel changes no node

#include "shaders/collision/depth.glsl"
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

float deepest(uint node, vec3 position) {
  NearList list = fetchNearList(node);
  if (!covers(list, position, position)) {
    list = allColliders(push.collision.colliderCount);
  }
  float depth = 0.0;
  for (uint i = 0; i < list.count; ++i) {
    Collider collider = fetchCollider(colliderAt(list, i), push.collision, 0.0, 0.0);
    if (mayTouch(collider, position, position)) {
      depth = max(depth, depthIn(collider, fetchFrame(collider, push.collision), position));
    }
  }
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
      depth = max(depth, deepest(firstNode + i, here.xyz));
    }
  }
  if (depth > 0.0) {
    atomicMax(counts[number * kReportCounts + kStretchBins], floatBitsToUint(depth));
  }
}
