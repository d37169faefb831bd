// SPDX-License-Identifier: MIT
// Tables and push constants of cloth that follows joints. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_CLOTH_SKIN_CLOTH_SKIN_H
#define CLOTHSTREAM_SHADERS_CLOTH_SKIN_CLOTH_SKIN_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A node with its place where the joints rest.
#define CLOTHSTREAM_SKINNED_TEXELS 4
struct SkinnedRecord {
  vec3 place;         // in the frame of the collider, m
  float node;         // in the scene
  vec3 normal;        // of length 1, or 0 if the node has none
  float maxDistance;  // m, kUnboundedDistance if it is unbounded
  float joints01;     // two joints of the cloth: the first plus kJointBase times the second
  float joints23;
  float backstopDistance;  // m
  float backstopRadius;    // m; 0: no backstop
  float weights[4];
};

const float kJointBase = 128;
// Its square is finite.
const float kUnboundedDistance = 1e18f;

// Where the joints take a node with limits during a tick. It moves in a straight line.
#define CLOTHSTREAM_LIMIT_TEXELS 4
struct LimitRecord {
  vec3 place;  // at the tick's start
  float maxDistance;
  vec3 motion;  // during the tick
  float node;
  vec3 normal;  // at the tick's start, of length 1
  float backstopDistance;
  vec3 normalChange;  // during the tick
  float backstopRadius;
};

// Transforms of joints, as in shaders/collision/solid.h.
#define CLOTHSTREAM_CLOTH_JOINT_TEXELS 3

// The nodes of one cloth. Records of nodes with limits come first, then those of nodes that follow their
// joints exactly, then those of free nodes.
struct PlacePush {
  uint32_t firstRecord;
  uint32_t limitedCount;
  uint32_t exactCount;
  uint32_t firstLimit;  // LimitRecord of the first node
  uint32_t firstJoint;  // transforms at the tick's start, then at its end
  uint32_t jointCount;
  float tickRate;  // 1/s
  uint32_t reserved;
};

// A jump of the joints of one cloth at the tick's start.
struct SkinJumpPush {
  uint32_t firstRecord;
  uint32_t count;
  uint32_t firstBefore;  // transforms before the jump
  uint32_t firstAfter;
};

struct LimitPush {
  uint32_t count;
  float progress;  // share of the tick at the substep's end
  float tickRate;  // 1/s
  uint32_t reserved;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(SkinnedRecord) == CLOTHSTREAM_SKINNED_TEXELS * sizeof(vec4) &&
              offsetof(SkinnedRecord, normal) == 16 && offsetof(SkinnedRecord, weights) == 48);
static_assert(sizeof(LimitRecord) == CLOTHSTREAM_LIMIT_TEXELS * sizeof(vec4) &&
              offsetof(LimitRecord, motion) == 16 && offsetof(LimitRecord, normalChange) == 48);
}  // namespace clothstream::shared
#endif

#endif
