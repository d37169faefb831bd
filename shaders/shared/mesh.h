// SPDX-License-Identifier: MIT
// Tables of meshes, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MESH_H
#define CLOTHSTREAM_SHADERS_SHARED_MESH_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Read as texels of four floats, as the tables of simulation.h are.

// Where the springs and triangles of a node are listed, two texels. Nodes of all meshes in their order.
#define CLOTHSTREAM_MESH_NODE_TEXELS 2
struct MeshNodeRecord {
  vec4 springs;    // first texel modulo 2^16, first / 2^16, how many texels
  vec4 triangles;  // likewise
};

// Two springs as one of their nodes sees them, in the order of model::springAdjacency(): the other node's
// number in the scene plus one, negative of a shear spring; the rest length, negative of a bend spring. The
// last texel is filled with a spring from the node to itself, which pulls with exactly zero.
struct SpringPairRecord {
  vec4 ends;
};

// Two triangles as one of their corners sees them: the others, nodes of the scene, in the triangle's own
// sense. The last texel is filled with a triangle of the node alone, which has exactly no area.
struct CornerPairRecord {
  vec4 corners;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(MeshNodeRecord) == 32 && offsetof(MeshNodeRecord, triangles) == 16);
static_assert(sizeof(SpringPairRecord) == 16 && sizeof(CornerPairRecord) == 16);
}  // namespace clothstream::shared
#endif

#endif
