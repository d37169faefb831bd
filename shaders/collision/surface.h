// SPDX-License-Identifier: MIT
// Tables and push constants of collision with surfaces of the real room. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_SURFACE_H
#define CLOTHSTREAM_SHADERS_COLLISION_SURFACE_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A surface in a tick, in which it stands still. Its triangles are a SolidRecord and what follows it in the
// table of meshes (solid.h); TriangleRecord::reserved1 has model::Surface::rims.
#define CLOTHSTREAM_SURFACE_TEXELS 4
struct SurfaceRecord {
  vec3 low;  // box in the world, m
  float solid;
  vec3 high;
  float twoSided;  // 1: nodes may be on both sides
  vec3 position;
  float friction;
  vec4 orientation;
};

// Triangles are this much wider where a path crosses them, so that none leads between two of them, m.
const float kSurfaceSeam = 2e-4f;
// Nodes of the trees that the searches of a node may visit in a substep. A node that would need more stays
// where it was.
const uint32_t kMostSurfaceVisits = 4096u;

struct SurfacePush {
  CollisionPush collision;
  uint32_t surfaceCount;
  uint32_t rounds;      // model::kSurfaceRounds
  float leastDistance;  // model::kLeastSurfaceDistance
  float depth;          // model::kSurfaceDepth
  float pushed;         // way of model::kSurfacePushSpeed in a substep, m
  uint32_t reserved0, reserved1, reserved2;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(SurfaceRecord) == CLOTHSTREAM_SURFACE_TEXELS * sizeof(vec4));
static_assert(sizeof(SurfacePush) == 64);
}  // namespace clothstream::shared
#endif

#endif
