// SPDX-License-Identifier: MIT
// Tables of meshes, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MESH_H
#define CLOTHSTREAM_SHADERS_SHARED_MESH_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Where the springs and triangles of a node are listed. Nodes of all meshes in their order.
struct MeshNodeRecord {
  uint32_t firstSpring;
  uint32_t springCount;
  uint32_t firstTriangle;
  uint32_t triangleCount;
};

// A spring as one of its nodes sees it, in the order of scene::springAdjacency().
struct SpringEndRecord {
  uint32_t other;  // node of the scene; the kind of spring in the two highest bits
  float restLength;
};

// A triangle as one of its corners sees it: the others, nodes of the scene, in the triangle's own sense.
struct TriangleCornerRecord {
  uint32_t second;
  uint32_t third;
};

CLOTHSTREAM_SHARED_FUNCTION uint32_t packOther(uint32_t node, uint32_t kind) {
  return node | (kind << 30);
}
CLOTHSTREAM_SHARED_FUNCTION uint32_t otherNode(uint32_t other) {
  return other & 0x3FFFFFFFu;
}
CLOTHSTREAM_SHARED_FUNCTION uint32_t springKind(uint32_t other) {
  return other >> 30;
}

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(MeshNodeRecord) == 16 && offsetof(MeshNodeRecord, triangleCount) == 12);
static_assert(sizeof(SpringEndRecord) == 8 && offsetof(SpringEndRecord, restLength) == 4);
static_assert(sizeof(TriangleCornerRecord) == 8 && offsetof(TriangleCornerRecord, third) == 4);
}  // namespace clothstream::shared
#endif

#endif
