// SPDX-License-Identifier: MIT
// Tables and push constants of collision with shapes. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_COLLISION_COLLISION_H
#define CLOTHSTREAM_SHADERS_COLLISION_COLLISION_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Values of ShapeRecord::kind.
const float kRoundShape = 0;   // sphere or capsule
const float kBoxShape = 1;     // box
const float kPlanesShape = 2;  // plane or convex hull
const float kSolidShape = 3;   // closed triangle mesh; solid.h
// Number of kinds. Kernels that depend on the kind compare it, and do not compile if it grows without them.
#define CLOTHSTREAM_SHAPE_KINDS 4

// The shape of a collider. The meaning of the other members depends on `kind`; the functions below name it.
struct ShapeRecord {
  float kind;
  vec3 sizes;
};

// A collider during one tick. The planes of all shapes follow behind the records, one texel each: normal,
// offset.
#define CLOTHSTREAM_COLLIDER_TEXELS 5
struct ColliderRecord {
  vec3 position;  // at the tick's start
  float reach;    // radius of a sphere about `position` that contains the shape
  vec3 motion;    // displacement during the tick
  float friction;
  vec4 orientation;        // unit quaternion at the tick's start
  vec4 orientationChange;  // difference of the quaternions during the tick
  ShapeRecord shape;
};

// The box that contains a collider, or kColliderGroup consecutive colliders, during the whole tick.
#define CLOTHSTREAM_BOUNDS_TEXELS 2
struct ColliderBounds {
  vec3 low;
  float farthestMotion;  // m, the largest displacement of any of them
  vec3 high;
  float reserved;
};
const uint32_t kColliderGroup = 32;

// The list of the colliders that kNearNodes consecutive nodes of the scene may touch in a tick, kNearStride
// floats: the box within which the list is valid (low, count, high, unused), then ascending collider numbers.
// A count above kMaxNear means that there are too many and none is listed.
const uint32_t kNearNodes = 16;
const uint32_t kMaxNear = 56;
const uint32_t kNearLow = 0;
const uint32_t kNearCount = 3;
const uint32_t kNearHigh = 4;
const uint32_t kNearHeader = 8;
const uint32_t kNearStride = 8 + 56;

// The thickness of a cloth adds at most this multiple of itself to a shape's reach (at the corner of a box).
const float kThicknessReach = 1.75;

// Rounding error of a contact's depth, relative to coordinates.
const float kDepthRounding = 2.4e-7f;

// Two contacts pinch a node if the product of their normals is below this.
const float kOpposed = -0.5f;

// One substep.
struct CollisionPush {
  uint32_t colliderCount;
  float progressBefore;  // share of the tick's motion at the substep's start
  float progressAfter;
  float tickRate;  // 1/s
  float substepRate;
  uint32_t contactClothCount;  // cloths in the scene if contacts are reported, else 0
  uint32_t nodeWork;           // for the host: work of a node that collides (vulkan::Recorder::dispatch)
  float substepSeconds;
};

// The effect of a collider on a cloth in a tick is one number, at (collider times cloths plus cloth): the
// impulse in units of 1 / kImpulseUnits N s, plus one for each contact. 0: they do not touch.
const float kImpulseUnits = 1e6f;
// The largest impulse that one contact adds, N s.
const float kMaxImpulse = 1000;

struct GatherPush {
  uint32_t nodeCount;
  uint32_t colliderCount;
  float tickSeconds;
  float thickness;  // the largest of any cloth, m
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {

// `slope`: model::slopeOf().
inline ShapeRecord roundShape(float radius, float halfLength, float slope) {
  return {kRoundShape, {radius, halfLength, slope}};
}
inline ShapeRecord boxShape(const vec3& halfSize) {
  return {kBoxShape, halfSize};
}
// `firstPlane` is a texel of the colliders' table.
inline ShapeRecord planesShape(float firstPlane, float planeCount) {
  return {kPlanesShape, {firstPlane, planeCount, 0}};
}

static_assert(sizeof(ColliderRecord) == CLOTHSTREAM_COLLIDER_TEXELS * sizeof(vec4) &&
              offsetof(ColliderRecord, motion) == 16 && offsetof(ColliderRecord, orientation) == 32 &&
              offsetof(ColliderRecord, orientationChange) == 48 && offsetof(ColliderRecord, shape) == 64);
static_assert(sizeof(ColliderBounds) == CLOTHSTREAM_BOUNDS_TEXELS * sizeof(vec4) &&
              offsetof(ColliderBounds, high) == 16);
static_assert(sizeof(CollisionPush) == 32 && offsetof(CollisionPush, substepRate) == 16);
static_assert(sizeof(GatherPush) == 16);
}  // namespace clothstream::shared
#else

float radiusOf(ShapeRecord shape) {
  return shape.sizes.x;
}
float halfLengthOf(ShapeRecord shape) {
  return shape.sizes.y;
}
float slopeOf(ShapeRecord shape) {
  return shape.sizes.z;
}
vec3 halfSizeOf(ShapeRecord shape) {
  return shape.sizes;
}
uint firstPlaneOf(ShapeRecord shape) {
  return uint(shape.sizes.x);
}
uint planeCountOf(ShapeRecord shape) {
  return uint(shape.sizes.y);
}

ColliderRecord colliderRecordAt(samplerBuffer table, uint collider) {
  int first = CLOTHSTREAM_COLLIDER_TEXELS * int(collider);
  vec4 start = texelFetch(table, first);
  vec4 motion = texelFetch(table, first + 1);
  vec4 shape = texelFetch(table, first + 4);
  return ColliderRecord(CLOTHSTREAM_VECTOR(start), CLOTHSTREAM_VECTOR(motion), texelFetch(table, first + 2),
                        texelFetch(table, first + 3), ShapeRecord(shape.x, shape.yzw));
}

ColliderBounds colliderBoundsAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_BOUNDS_TEXELS * int(number);
  vec4 low = texelFetch(table, first);
  vec4 high = texelFetch(table, first + 1);
  return ColliderBounds(CLOTHSTREAM_VECTOR(low), CLOTHSTREAM_VECTOR(high));
}

#endif

#endif
