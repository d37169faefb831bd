// SPDX-License-Identifier: MIT
// The mesh node that an invocation works on.
//
// Loops over a node's springs or triangles test first. The count differs between invocations, and in a loop
// that tests at its end lavapipe 22.3 lets finished invocations run on.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MESH_NODE_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_MESH_NODE_GLSL

#include "shaders/shared/mesh.h"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;   // MeshTileRecord
// The including kernel defines the first binding of the lists.
layout(binding = CLOTHSTREAM_MESH_BINDING) uniform samplerBuffer meshNodes;            // MeshNodeRecord
layout(binding = CLOTHSTREAM_MESH_BINDING + 1) uniform samplerBuffer triangleCorners;  // CornerPairRecord

struct MeshNode {
  bool exists;
  uint cloth;
  uint index;   // in the scene
  uint number;  // among the nodes of all meshes
};

MeshNode locateMeshNode(uint firstTile) {
  MeshTileRecord tile = meshTileAt(tiles, firstTile + gl_WorkGroupID.x);
  MeshNode node;
  node.cloth = uint(tile.cloth);
  ClothRecord cloth = clothAt(cloths, node.cloth);
  uint inCloth = uint(tile.firstNode) + gl_LocalInvocationID.x;
  node.exists = inCloth < nodeCountOf(cloth);
  node.index = firstNodeOf(cloth) + inCloth;
  node.number = uint(tile.firstMeshNode) + gl_LocalInvocationID.x;
  return node;
}

TexelRange springsOf(MeshNode node) {
  return rangeOf(meshNodeAt(meshNodes, node.number).springs);
}

TexelRange trianglesOf(MeshNode node) {
  return rangeOf(meshNodeAt(meshNodes, node.number).triangles);
}

#endif
