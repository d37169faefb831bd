// SPDX-License-Identifier: MIT
// Which node of which mesh an invocation works on.
//
// Loops over a node's springs or triangles test first: their number differs between invocations, and lavapipe
// 22.3 lets those that are done run on in a loop that tests at its end.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MESH_NODE_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_MESH_NODE_GLSL

#include "shaders/shared/mesh.h"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;   // TileRecord of meshes
// Where a kernel binds the lists; it says so before it includes this.
layout(binding = CLOTHSTREAM_MESH_BINDING) uniform samplerBuffer meshNodes;            // MeshNodeRecord
layout(binding = CLOTHSTREAM_MESH_BINDING + 1) uniform samplerBuffer triangleCorners;  // CornerPairRecord

struct MeshNode {
  bool exists;
  int cloth;   // first texel of its record
  uint index;  // in the scene
  int lists;   // first texel of its MeshNodeRecord
};

MeshNode locateMeshNode(uint firstTile) {
  vec4 tile = texelFetch(tiles, int(firstTile + gl_WorkGroupID.x));
  MeshNode node;
  node.cloth = CLOTHSTREAM_CLOTH_TEXELS * int(tile.x);
  vec4 place = texelFetch(cloths, node.cloth);
  uint inCloth = uint(tile.y) + gl_LocalInvocationID.x;
  node.exists = inCloth < uint(place.w);
  node.index = uint(place.x) + (uint(place.y) << 16) + inCloth;
  node.lists = CLOTHSTREAM_MESH_NODE_TEXELS * int(uint(tile.z) + gl_LocalInvocationID.x);
  return node;
}

struct TexelRange {
  int first;
  int end;
};

TexelRange springsOf(MeshNode node) {
  vec4 list = texelFetch(meshNodes, node.lists);
  int first = int(uint(list.x) + (uint(list.y) << 16));
  return TexelRange(first, first + int(list.z));
}

TexelRange trianglesOf(MeshNode node) {
  vec4 list = texelFetch(meshNodes, node.lists + 1);
  int first = int(uint(list.x) + (uint(list.y) << 16));
  return TexelRange(first, first + int(list.z));
}

#endif
