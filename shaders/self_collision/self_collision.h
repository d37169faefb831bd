// SPDX-License-Identifier: MIT
// Tables and push constants of self-collision, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_SELF_COLLISION_SELF_COLLISION_H
#define CLOTHSTREAM_SHADERS_SELF_COLLISION_SELF_COLLISION_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Balls are the nodes of cloths with self-collision. They fall into cells, cubes of space that share the
// entries of a table: neighbouring cells of a row lie next to each other in it, and behind its last is its
// first. kCellBlock entries are added up together.
const uint32_t kCellBlock = 256;
// Where this many balls lie in three cells of a row, the cells are passed over, and those who look there are
// counted as crowded.
const uint32_t kMaxInRow = 1024;

// Whom a node may touch until lists are made anew, in floats: how many, its own radius and friction, -; then
// their nodes plus one, ascending by cell and then by node, negative of another cloth; 0 fills the last
// texel.
const uint32_t kMaxNeighbours = 60;
const uint32_t kNeighbourStride = 4 + 60;

// Whom a node touches at most, by the same numbers; 0 fills the last texel.
const uint32_t kMaxContacts = 32;

// Workgroups of the kernel that resolves contacts, and how many nodes they are for.
struct ContactGroups {
  uint32_t x, y, z;
  uint32_t touching;
};

// Of the table, in words behind its entries and its blocks: the box of all velocities (the largest of x, y,
// z, then of -x, -y, -z, as bits that order as floats do); where balls look for each other (m); 1 / a cell's
// width, both as bits of floats.
const uint32_t kVelocityWords = 6;
const uint32_t kSearchWord = 6;
const uint32_t kCellWord = 7;
const uint32_t kTableWords = 8;

struct NeighbourPush {
  uint32_t nodeCount;
  uint32_t cellCount;  // a power of two, at least kCellBlock
  float aheadSeconds;  // how long lists are to do, and a quarter more
  float reach;         // m, the largest sum of two radii
  float restFactor;    // of the sum of two radii, below which a pair at rest does not collide
};

struct ContactPush {
  CollisionPush collision;
  uint32_t nodeCount;
  float substepSeconds;
  float correctionFraction;     // of an overlap, 1/s
  float pushOutSpeed;  // m/s
};

// What of a tick did not fit.
struct CrowdReport {
  uint32_t lists;  // of neighbours, that were too long
  uint32_t balls;  // that touched more than kMaxContacts others, each time
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(NeighbourPush) == 20 && sizeof(CrowdReport) == 8);
static_assert(sizeof(ContactGroups) == 16 && offsetof(ContactGroups, touching) == 12);
static_assert(sizeof(ContactPush) == 48 && offsetof(ContactPush, nodeCount) == 32);
}  // namespace clothstream::shared
#endif

#endif
