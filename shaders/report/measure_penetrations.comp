// SPDX-License-Identifier: MIT
// How deep nodes that can move lie in a collider at the tick's end: an invocation kReportDepths nodes. The
// deepest of a cloth is found by an atomic maximum of the depths' bits, which order as the depths do, in
// whatever order they come.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 4;
const int kContactImpulseBinding = 6;  // nobody collides here

#include "shaders/collision/collide.glsl"
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

// Below the shape's surface, along the nearest of its planes; not above 0 outside.
float depthIn(Collider collider, ColliderFrame frame, vec3 position) {
  precise vec3 offset = position - collider.after;
  precise vec3 p = rotateBack(frame.after, offset);
  if (frame.shape.x == kRoundShape) {
    precise vec3 out_ = p - onSegment(p.y, frame.shape.z);
    precise float squared = max(dotProduct(out_, out_), 1e-24);
    precise float depth = frame.shape.y - squared * reciprocalSquareRoot(squared);
    return depth;
  }
  bool isBox = frame.shape.x == kBoxShape;
  uint count = isBox ? 6u : uint(frame.shape.z);
  float highest = -1e30;
  for (uint i = 0; i < count; ++i) {
    vec4 plane = isBox ? boxPlane(frame.shape.yzw, i) : texelFetch(colliders, int(frame.shape.y) + int(i));
    precise float height = dotProduct(plane.xyz, p) - plane.w;
    highest = max(highest, height);
  }
  return -highest;
}

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
  vec4 blockPlace = texelFetch(blocks, int(block));
  uint cloth = uint(blockPlace.x);
  vec4 place = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(cloth));
  uint firstNode = uint(place.x) + (uint(place.y) << 16);
  uint nodes = place.z == 0.0 ? uint(place.w) : uint(place.z) * uint(place.w);
  uint first = uint(blockPlace.y);
  uint end = min(first + kReportBlock, nodes);
  float depth = 0.0;
  for (uint i = first + gl_GlobalInvocationID.x - block * kRuns; i < end; i += kRuns) {
    vec4 here = texelFetch(positions, int(firstNode + i));
    if (here.w > 0.0) {
      depth = max(depth, deepest(firstNode + i, here.xyz));
    }
  }
  if (depth > 0.0) {
    atomicMax(counts[cloth * kReportCounts + kStretchBins], floatBitsToUint(depth));
  }
}
