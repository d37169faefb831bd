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
layout(std430, binding = CLOTHSTREAM_MESH_BINDING) readonly buffer MeshNodes {
  MeshNodeRecord meshNodes[];
};
layout(std430, binding = CLOTHSTREAM_MESH_BINDING + 1) readonly buffer TriangleCorners {
  TriangleCornerRecord triangleCorners[];
};

struct MeshNode {
  bool exists;
  int cloth;   // first texel of its record
  uint index;  // in the scene
  MeshNodeRecord lists;
};

MeshNode locateMeshNode(uint firstTile) {
  vec4 tile = texelFetch(tiles, int(firstTile + gl_WorkGroupID.x));
  MeshNode node;
  node.cloth = CLOTHSTREAM_CLOTH_TEXELS * int(tile.x);
  vec4 place = texelFetch(cloths, node.cloth);
  uint inCloth = uint(tile.y) + gl_LocalInvocationID.x;
  node.exists = inCloth < uint(place.w);
  node.index = uint(place.x) + (uint(place.y) << 16) + inCloth;
  if (node.exists) {
    node.lists = meshNodes[uint(tile.z) + gl_LocalInvocationID.x];
  }
  return node;
}

#endif
