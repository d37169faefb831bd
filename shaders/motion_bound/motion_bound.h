// SPDX-License-Identifier: MIT
// Tables and push constants of the bound on motion that keeps cloth from passing through cloth. C++ and GLSL
// use the same layout.
#ifndef CLOTHSTREAM_SHADERS_MOTION_BOUND_MOTION_BOUND_H
#define CLOTHSTREAM_SHADERS_MOTION_BOUND_MOTION_BOUND_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A node (both ends are the same) or an edge of the cloths.
struct PartRecord {
  float first;
  float second;
  float reserved0, reserved1;
};

// A triangle with the edges and corners that belong to it: each edge and each node of the cloths belongs to
// one triangle. An edge is its place among the parts, or -1. Edge k is from corner k to the next one.
#define CLOTHSTREAM_FACE_TEXELS 2
struct FaceRecord {
  vec3 corners;
  float box;  // its leaf in the tree of boxes
  vec3 edges;
  float owned;  // bit k: corner k
};

// An inner box of the tree, with what a search visits next if the box is missed. Boxes are in the order of a
// depth-first search: the first child of a box follows it.
struct BranchRecord {
  float box;
  float next;
  float reserved0, reserved1;
};

// A box of the tree during a substep: low corner, next box if it is missed, high corner, triangle (negative
// in an inner box).
#define CLOTHSTREAM_TREE_BOX_TEXELS 2

// A list of pairs is worked on in parts of this many pairs, a dispatch each, so that no dispatch is long.
const uint32_t kPartPairs = 32768;
// Header of a list of pairs: the number of pairs, and, for triangles, how many kVisitBlock boxes of the tree
// the searches have visited. Then the dispatch sizes of its parts follow: x, y, z each.
struct PairCounts {
  uint32_t count;
  uint32_t visits;
};
const uint32_t kPartSizes = 2;  // number at which the dispatch sizes begin
const uint32_t kVisitBlock = 256;
// Limit on the boxes that one search visits. lavapipe allows an invocation 65,535 loop rounds, and a visit
// takes up to two.
const uint32_t kMostVisits = 24576;

struct TreePush {
  uint32_t first;  // record
  uint32_t count;  // records
  float gap;       // m, the distance that the cloth keeps from itself
};

struct PairPush {
  uint32_t faceCount;
  uint32_t boxCount;
  uint32_t facePairs;  // capacities of the lists
  uint32_t nodePairs;
  uint32_t edgePairs;
  float gap;           // m
  uint32_t visits;     // in blocks, that all searches may make together
  uint32_t firstPair;  // of the part
};

struct NodePush {
  uint32_t nodeCount;
  uint32_t facePairs;  // capacities of the lists
  uint32_t nodePairs;
  uint32_t edgePairs;
  float gap;
  float substepRate;  // 1/s
};

struct DepthPush {
  CollisionPush collision;
  uint32_t nodeCount;
  float touch;  // m, distance at which a node touches a collider
  uint32_t reserved0, reserved1;
};

// Corrections of nodes are sums of whole numbers in units of 1 / kCorrectionUnits m, and their weights in
// units of 1 / kCorrectionWeight.
const float kCorrectionUnits = 16777216.0f;
const float kCorrectionWeight = 65536.0f;

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(PartRecord) == 16 && sizeof(BranchRecord) == 16);
static_assert(sizeof(FaceRecord) == CLOTHSTREAM_FACE_TEXELS * sizeof(vec4) &&
              offsetof(FaceRecord, edges) == 16);
static_assert(sizeof(DepthPush) == 48);
static_assert(sizeof(PairCounts) == kPartSizes * sizeof(std::uint32_t));
static_assert(sizeof(PairPush) == 32 && sizeof(NodePush) == 24);
}  // namespace clothstream::shared
#else

PartRecord partAt(samplerBuffer table, uint part) {
  vec4 texel = texelFetch(table, int(part));
  return PartRecord(CLOTHSTREAM_FLOATS(texel));
}

FaceRecord faceAt(samplerBuffer table, uint face) {
  int first = CLOTHSTREAM_FACE_TEXELS * int(face);
  vec4 corners = texelFetch(table, first);
  vec4 edges = texelFetch(table, first + 1);
  return FaceRecord(CLOTHSTREAM_VECTOR(corners), CLOTHSTREAM_VECTOR(edges));
}

BranchRecord branchAt(samplerBuffer table, uint branch) {
  vec4 texel = texelFetch(table, int(branch));
  return BranchRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

#endif
