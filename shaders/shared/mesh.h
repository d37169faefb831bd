// SPDX-License-Identifier: MIT
// Tables of meshes: which springs and triangles meet at each node.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MESH_H
#define CLOTHSTREAM_SHADERS_SHARED_MESH_H

#include "shaders/shared/types.h"
#include "shaders/shared/whole_number.h"

CLOTHSTREAM_SHARED_BEGIN

// The lists of one node. Records follow the order of the nodes of all meshes.
#define CLOTHSTREAM_MESH_NODE_TEXELS 2
struct MeshNodeRecord {
  ListRecord springs;    // SpringPairRecords
  ListRecord triangles;  // CornerPairRecords
};

// One spring as one of its nodes sees it, in the order of model::springAdjacency(). `signedOther` is the
// other node in the scene plus one, negative for a shear spring. `signedLength` is the rest length, negative
// for a bend spring.
struct SignedSpring {
  float signedOther;
  float signedLength;  // m
};

// Two springs of a node. A spring from the node to itself, which pulls with exactly zero, fills the last
// record.
struct SpringPairRecord {
  SignedSpring springs[2];
};

// The other corners of one triangle as one of its corners sees it, in the triangle's orientation.
struct OtherCorners {
  float second;  // nodes in the scene
  float third;
};

// Two triangles of a node. A triangle of the node alone, which has exactly no area, fills the last record.
struct CornerPairRecord {
  OtherCorners triangles[2];
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(MeshNodeRecord) == CLOTHSTREAM_MESH_NODE_TEXELS * sizeof(vec4));
static_assert(sizeof(SpringPairRecord) == 16 && sizeof(CornerPairRecord) == 16);
}  // namespace clothstream::shared
#else

MeshNodeRecord meshNodeAt(samplerBuffer table, uint number) {
  uint first = CLOTHSTREAM_MESH_NODE_TEXELS * number;
  return MeshNodeRecord(listAt(table, first), listAt(table, first + 1));
}

SpringPairRecord springPairAt(samplerBuffer table, int texel) {
  vec4 pair = texelFetch(table, texel);
  return SpringPairRecord(SignedSpring[2](SignedSpring(pair.x, pair.y), SignedSpring(pair.z, pair.w)));
}

CornerPairRecord cornerPairAt(samplerBuffer table, int texel) {
  vec4 pair = texelFetch(table, texel);
  return CornerPairRecord(OtherCorners[2](OtherCorners(pair.x, pair.y), OtherCorners(pair.z, pair.w)));
}

#endif

#endif
