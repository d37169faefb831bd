// SPDX-License-Identifier: MIT
// Tables and push constants of self-collision. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_SELF_COLLISION_SELF_COLLISION_H
#define CLOTHSTREAM_SHADERS_SELF_COLLISION_SELF_COLLISION_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Balls are the nodes of cloths with self-collision. They fall into cells, which are cubes of space. Several
// cells share an entry of a hash table. Neighbouring cells of a row are neighbours in the table, which wraps
// round. kCellBlock entries are added up together.
const uint32_t kCellBlock = 256;
// Limit on the balls in three consecutive cells of a row. Searches skip a row of cells beyond it and count as
// crowded.
const uint32_t kMaxInRow = 1024;

// The rest state of a node.
struct RestRecord {
  vec3 position;
  float clothNumber;  // cloth plus one; 0: the node is no ball
};

// The nodes that a ball may touch until the next search, kNeighbourStride floats: NeighbourHead, then signed
// node numbers, ascending by cell and then by node. A number is the node plus one, negative for a node of
// another cloth; 0 fills the last texel.
struct NeighbourHead {
  float count;
  float radius;  // of the ball itself
  float friction;
  float reserved;
};
const uint32_t kNeighbourHead = 4;
const uint32_t kMaxNeighbours = 60;
const uint32_t kNeighbourStride = 4 + 60;

// The largest number of nodes that a ball touches, listed by the same signed numbers; 0 fills the last texel.
const uint32_t kMaxContacts = 32;

// Dispatch size of the kernel that resolves contacts, and the number of nodes that it works on.
struct ContactGroups {
  uint32_t x, y, z;
  uint32_t touching;
};

// Words of the table behind its entries and its blocks. First the box of all velocities: the largest of x, y,
// z, then of -x, -y, -z, as bits that order as floats do. Then the search radius (m) and the inverse width of
// a cell (1/m), as bits of floats.
const uint32_t kVelocityWords = 6;
const uint32_t kSearchWord = 6;
const uint32_t kCellWord = 7;
const uint32_t kTableWords = 8;

struct NeighbourPush {
  uint32_t nodeCount;
  uint32_t cellCount;  // a power of two, at least kCellBlock
  float aheadSeconds;  // 1.25 times the time until the next search
  float reach;         // m, the largest sum of two radii
  float restFactor;    // a pair closer at rest than this times the sum of its radii does not collide
};

struct ContactPush {
  CollisionPush collision;
  uint32_t nodeCount;
  float substepSeconds;
  float correctionRate;  // share of an overlap that is corrected per second, 1/s
  float pushOutSpeed;    // m/s
};

// Overflows during a tick.
struct CrowdReport {
  uint32_t lists;  // lists of neighbours that were too long
  uint32_t balls;  // balls that touched more than kMaxContacts others, each time
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(NeighbourPush) == 20 && sizeof(CrowdReport) == 8);
static_assert(sizeof(ContactGroups) == 16 && offsetof(ContactGroups, touching) == 12);
static_assert(sizeof(ContactPush) == 48 && offsetof(ContactPush, nodeCount) == 32);
static_assert(sizeof(RestRecord) == 16 && sizeof(NeighbourHead) == kNeighbourHead * sizeof(float));
}  // namespace clothstream::shared
#else

RestRecord restAt(samplerBuffer table, uint node) {
  vec4 texel = texelFetch(table, int(node));
  return RestRecord(CLOTHSTREAM_VECTOR(texel));
}

bool isBall(RestRecord rest) {
  return rest.clothNumber != 0.0;
}

uint clothOf(RestRecord rest) {
  return uint(rest.clothNumber) - 1;
}

NeighbourHead neighbourHeadAt(samplerBuffer table, int texel) {
  vec4 head = texelFetch(table, texel);
  return NeighbourHead(CLOTHSTREAM_FLOATS(head));
}

#endif

#endif
