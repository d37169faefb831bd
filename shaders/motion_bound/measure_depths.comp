// SPDX-License-Identifier: MIT
// Measures how deep free nodes of cloths that nothing passes through are inside each collider at the tick's
// end. The deepest node follows from an atomic maximum of the depths' bits, which order as the depths do.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 3;
const int kContactImpulseBinding = 5;  // unused: this kernel changes no node

#include "shaders/collision/depth.glsl"
#include "shaders/motion_bound/motion_bound.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer parts;      // PartRecord; the nodes come first
layout(binding = 1) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 2) buffer Depths {
  uint depths[];  // bits of metres, by collider
};

layout(push_constant) uniform Push {
  DepthPush push;
};

void main() {
  if (gl_GlobalInvocationID.x >= push.nodeCount) {
    return;
  }
  uint node = uint(partAt(parts, gl_GlobalInvocationID.x).first);
  vec4 here = texelFetch(positions, int(node));
  if (here.w == 0.0) {
    return;
  }
  NearList list = fetchNearList(node);
  if (!covers(list, here.xyz, here.xyz)) {
    list = allColliders(push.collision.colliderCount);
  }
  float deepest = 0.0;
  for (uint i = 0; i < list.count; ++i) {
    Collider collider = fetchCollider(colliderAt(list, i), push.collision, 0.0, 0.0);
    if (mayTouch(collider, here.xyz, here.xyz)) {
      deepest = max(deepest, depthIn(collider, fetchFrame(collider, push.collision), here.xyz));
    }
  }
  if (deepest <= 0.0) {
    return;
  }
  precise float outside = -push.touch;
  for (uint i = 0; i < list.count; ++i) {
    Collider collider = fetchCollider(colliderAt(list, i), push.collision, push.touch, 0.0);
    if (mayTouch(collider, here.xyz, here.xyz) &&
        depthIn(collider, fetchFrame(collider, push.collision), here.xyz) > outside) {
      atomicMax(depths[collider.number], floatBitsToUint(deepest));
    }
  }
}
