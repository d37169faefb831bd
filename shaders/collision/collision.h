// SPDX-License-Identifier: MIT
// Tables and push constants of collision, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_COLLISION_H
#define CLOTHSTREAM_SHADERS_COLLISION_COLLISION_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// What ColliderRecord::shape says first.
const float kRoundShape = 0;   // sphere or capsule: radius, half the length of its segment
const float kBoxShape = 1;     // half of its size
const float kPlanesShape = 2;  // plane or hull: first texel of its planes, how many

// A collider over one tick, five texels. Planes lie behind all records, a texel each: normal, offset.
struct ColliderRecord {
  vec4 start;   // where it is; w: reach, the radius of a sphere that holds it
  vec4 motion;  // how far it goes until the tick's end; w: friction
  vec4 turned;  // unit quaternion
  vec4 turn;    // what is added until the tick's end
  vec4 shape;
};

// The box that holds a collider, or a group of kColliderGroup that follow each other, during the whole tick.
struct ColliderBounds {
  vec4 low;  // w: the farthest that one of them goes
  vec4 high;
};
const uint32_t kColliderGroup = 32;

// What kNearNodes nodes that follow each other in the scene may touch in a tick, in floats: the box that the
// list is good for (low, count, high, -), then indices of colliders, ascending. A count above kMaxNear: too
// many, and none is listed.
const uint32_t kNearNodes = 64;
const uint32_t kMaxNear = 120;
const uint32_t kNearStride = 8 + 120;

// A cloth's thickness times this is the most that it adds to a shape's reach: at the corner of a box.
const float kThicknessReach = 1.75;

// One substep.
struct CollisionPush {
  uint32_t colliderCount;
  float progressBefore;  // of the tick's motion, at the substep's start
  float progressAfter;
  float tickRate;  // 1/s
  float substepRate;
  uint32_t contactClothCount;  // cloths of the scene, where contacts are to be told of; else 0
  uint32_t reserved0, reserved1;
};

// What a collider does to a cloth in a tick is one number, at collider times cloths plus cloth: the impulse
// in units of which a N s has so many, and one more for each touch; 0: they do not touch.
const float kImpulseUnits = 1e6f;
// The most that one touch adds.
const float kMostImpulse = 1000;

struct GatherPush {
  uint32_t nodeCount;
  uint32_t colliderCount;
  float tickSeconds;
  float thickness;  // the largest of any cloth
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ColliderRecord) == 80 && offsetof(ColliderRecord, motion) == 16 &&
              offsetof(ColliderRecord, turned) == 32 && offsetof(ColliderRecord, turn) == 48 &&
              offsetof(ColliderRecord, shape) == 64);
static_assert(sizeof(ColliderBounds) == 32 && offsetof(ColliderBounds, high) == 16);
static_assert(sizeof(CollisionPush) == 32 && offsetof(CollisionPush, substepRate) == 16);
static_assert(sizeof(GatherPush) == 16);
}  // namespace clothstream::shared
#endif

#endif
