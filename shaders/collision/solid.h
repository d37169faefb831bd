// SPDX-License-Identifier: MIT
// Tables and push constants of collision with triangle meshes. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_SOLID_H
#define CLOTHSTREAM_SHADERS_COLLISION_SOLID_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A mesh that nodes collide with. The numbers say where its parts are in the table of solids, in texels. A
// ShapeRecord of kind kSolidShape has the texel of this record.
#define CLOTHSTREAM_SOLID_TEXELS 2
struct SolidRecord {
  float firstTriangle;  // CLOTHSTREAM_TRIANGLE_TEXELS each, in the order of the leaves
  float firstVertex;
  float firstBox;  // CLOTHSTREAM_BOX_TEXELS for each node of the tree, which is in the order of a heap
  float leafCount;

  float triangleCount;
  float motion;  // m, no vertex moves farther in the tick, seen from the collider
  float reserved0, reserved1;
};

// The corners of a triangle, and the triangles across its edges 0-1, 1-2 and 2-0.
#define CLOTHSTREAM_TRIANGLE_TEXELS 2
struct TriangleRecord {
  vec3 corners;
  float reserved0;
  vec3 neighbours;
  float reserved1;
};

// A vertex at the start of the tick. The normal need not have the length 1.
#define CLOTHSTREAM_VERTEX_TEXELS 2
struct VertexRecord {
  vec3 position;
  float reserved0;
  vec3 normal;
  float reserved1;
};

#define CLOTHSTREAM_BOX_TEXELS 2
struct BoxRecord {
  vec3 low;
  float reserved0;
  vec3 high;
  float reserved1;
};

// Consecutive nodes of a cloth, for one workgroup.
struct NodeTileRecord {
  float cloth;
  float firstNode;  // in the cloth
  float reserved0, reserved1;
};

// Nodes deeper inside a mesh than this are found only if their way in the substep is as long, m.
const float kSolidDepth = 0.03f;

struct SolidPush {
  CollisionPush collision;
  uint32_t firstSolid;  // number of the first collider that is a mesh
  uint32_t solidCount;
  uint32_t reserved0, reserved1;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
// `record` is the texel of the SolidRecord.
inline ShapeRecord solidShape(float record) {
  return {kSolidShape, {record, 0, 0}};
}

static_assert(sizeof(SolidRecord) == CLOTHSTREAM_SOLID_TEXELS * sizeof(vec4));
static_assert(sizeof(TriangleRecord) == CLOTHSTREAM_TRIANGLE_TEXELS * sizeof(vec4));
static_assert(sizeof(VertexRecord) == CLOTHSTREAM_VERTEX_TEXELS * sizeof(vec4));
static_assert(sizeof(BoxRecord) == CLOTHSTREAM_BOX_TEXELS * sizeof(vec4));
static_assert(sizeof(NodeTileRecord) == 16 && sizeof(SolidPush) == 48);
}  // namespace clothstream::shared
#else

uint solidTexelOf(ShapeRecord shape) {
  return uint(shape.sizes.x);
}

SolidRecord solidRecordAt(samplerBuffer table, uint texel) {
  vec4 parts = texelFetch(table, int(texel));
  vec4 counts = texelFetch(table, int(texel) + 1);
  return SolidRecord(CLOTHSTREAM_FLOATS(parts), CLOTHSTREAM_FLOATS(counts));
}

uvec3 cornersAt(samplerBuffer table, SolidRecord solid, uint triangle) {
  return uvec3(
      texelFetch(table, int(uint(solid.firstTriangle) + CLOTHSTREAM_TRIANGLE_TEXELS * triangle)).xyz);
}

uvec3 neighboursAt(samplerBuffer table, SolidRecord solid, uint triangle) {
  return uvec3(
      texelFetch(table, int(uint(solid.firstTriangle) + CLOTHSTREAM_TRIANGLE_TEXELS * triangle) + 1).xyz);
}

NodeTileRecord nodeTileAt(samplerBuffer table, uint tile) {
  vec4 texel = texelFetch(table, int(tile));
  return NodeTileRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

#endif
