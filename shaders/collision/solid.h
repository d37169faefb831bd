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
  // CLOTHSTREAM_BOX_TEXELS for each node of the tree, which is in the order of a heap, or
  // CLOTHSTREAM_MOVING_BOX_TEXELS if joints move the mesh.
  float firstBox;
  float leafCount;

  float triangleCount;
  float vertexTexels;  // CLOTHSTREAM_VERTEX_TEXELS, or CLOTHSTREAM_MOVING_VERTEX_TEXELS if joints move them
  float firstGrid;     // DistanceGridRecord; 0: contact is with the triangles
  float reserved;
};

// Signed distances at the points of a grid. A texel for each point follows, x first.
#define CLOTHSTREAM_DISTANCE_GRID_TEXELS 2
struct DistanceGridRecord {
  vec3 origin;  // m
  float cell;   // m
  vec3 counts;  // of points along x, y and z
  float inverseCell;
};

// The corners of a triangle, and the triangles across its edges 0-1, 1-2 and 2-0.
#define CLOTHSTREAM_TRIANGLE_TEXELS 2
struct TriangleRecord {
  vec3 corners;
  float reserved0;
  vec3 neighbours;
  float reserved1;
};

// A vertex. The normal need not have the length 1. A vertex that joints move has two records, for the start
// and for the end of the tick.
#define CLOTHSTREAM_VERTEX_TEXELS 2
#define CLOTHSTREAM_MOVING_VERTEX_TEXELS 4
struct VertexRecord {
  vec3 position;
  float reserved0;
  vec3 normal;
  float reserved1;
};

// A box of the tree. A mesh that joints move has two for each node of the tree, for the start and for the end
// of the tick. In between, its triangles are in the box that is in between.
#define CLOTHSTREAM_BOX_TEXELS 2
#define CLOTHSTREAM_MOVING_BOX_TEXELS 4
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

// A vertex as the joints find it at rest, and the joints that move it.
#define CLOTHSTREAM_SKIN_VERTEX_TEXELS 3
struct SkinVertexRecord {
  vec3 position;
  float reserved;
  float joints[4];
  float weights[4];
};

// A triangle around a vertex: its other corners, counter-clockwise seen from outside.
struct FanRecord {
  float next;
  float last;
  float reserved0, reserved1;
};

// Texels of a transform of a joint: the rows of a matrix, rotation and translation.
#define CLOTHSTREAM_TRANSFORM_TEXELS 3

// Kernels that follow the joints of one mesh. The numbers are texels, and `firstJoint` is a transform.
struct SkinPush {
  uint32_t vertexCount;
  uint32_t firstRest;
  uint32_t firstFan;
  uint32_t firstVertex;
  uint32_t firstJoint;
  uint32_t jointCount;
  uint32_t reserved0, reserved1;
};

// Nodes of a tree: `levels` levels of those below each root, from the root on.
struct RefitPush {
  uint32_t solid;  // texel of the SolidRecord
  uint32_t firstRoot;
  uint32_t rootCount;
  uint32_t levels;
};

// Samples the distances of one mesh.
struct SamplePush {
  uint32_t solid;  // texel of the SolidRecord
  uint32_t reserved0, reserved1, reserved2;
};

// Nodes deeper inside a mesh than this are found only if their way in the substep is as long, m.
const float kSolidDepth = 0.03f;
// Nodes of the tree that the searches for one contact may visit, a quarter of those of the largest mesh.
const uint32_t kMostSolidVisits = 4096u;

struct SolidPush {
  CollisionPush collision;
  uint32_t solidCount;  // colliders that are triangle meshes; their numbers follow those of the others
  uint32_t reserved0, reserved1, reserved2;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
// `record` is the texel of the SolidRecord. No vertex moves farther than `motion` in the tick, seen from the
// collider, m.
inline ShapeRecord solidShape(float record, float motion) {
  return {kSolidShape, {record, motion, 0}};
}

static_assert(sizeof(SolidRecord) == CLOTHSTREAM_SOLID_TEXELS * sizeof(vec4));
static_assert(sizeof(TriangleRecord) == CLOTHSTREAM_TRIANGLE_TEXELS * sizeof(vec4));
static_assert(sizeof(VertexRecord) == CLOTHSTREAM_VERTEX_TEXELS * sizeof(vec4));
static_assert(sizeof(BoxRecord) == CLOTHSTREAM_BOX_TEXELS * sizeof(vec4));
static_assert(sizeof(SkinVertexRecord) == CLOTHSTREAM_SKIN_VERTEX_TEXELS * sizeof(vec4));
static_assert(sizeof(DistanceGridRecord) == CLOTHSTREAM_DISTANCE_GRID_TEXELS * sizeof(vec4));
static_assert(sizeof(SamplePush) == 16);
static_assert(sizeof(FanRecord) == 16 && sizeof(SkinPush) == 32 && sizeof(RefitPush) == 16);
static_assert(sizeof(NodeTileRecord) == 16 && sizeof(SolidPush) == 48);
}  // namespace clothstream::shared
#else

uint solidTexelOf(ShapeRecord shape) {
  return uint(shape.sizes.x);
}
float solidMotionOf(ShapeRecord shape) {
  return shape.sizes.y;
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
