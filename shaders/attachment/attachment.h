// SPDX-License-Identifier: MIT
// Tables and push constants of what holds cloth: attachments, grabs, tethers. Alike in C++ and in GLSL's
// std430.
#ifndef CLOTHSTREAM_SHADERS_ATTACHMENT_ATTACHMENT_H
#define CLOTHSTREAM_SHADERS_ATTACHMENT_ATTACHMENT_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A node that goes with a frame, two texels.
struct AttachedRecord {
  vec4 node;   // its number, the frame's
  vec4 place;  // in the frame, m
};

// Where a frame is at the tick's end, two texels.
struct FrameRecord {
  vec4 position;
  vec4 orientation;  // unit quaternion
};

// How far a node may get from two nodes that forces do not move, a texel.
struct TetherRecord {
  vec4 anchors;  // number + 1, or 0 where there is none, and metres; of another one likewise
};

// What GrabRecord::state is.
const float kReleasedGrab = 0;  // whatever it held it lets go
const float kActiveGrab = 1;
const float kBeginningGrab = 2;  // from this tick's start on

// A grab over one tick, five texels.
struct GrabRecord {
  vec4 start;   // where it is; w: square of the distance beyond which a node slips away
  vec4 motion;  // how far it goes until the tick's end; w: force, N
  vec4 turned;  // unit quaternion
  vec4 turn;    // what is added until the tick's end
  vec4 state;   // kReleasedGrab ...; squares of radius and reach
};

// What becomes of a grab.
struct GrabReport {
  uint32_t nearest;  // bits of the square of the distance of the node nearest to it when it took hold
  uint32_t held;     // nodes that it took hold of
  uint32_t slipped;  // those of them that slipped away
  uint32_t reserved;
};

struct AimPush {
  uint32_t count;
  float tickRate;  // 1/s
  float maxSpeed;  // m/s
};

struct GrabPush {
  uint32_t nodeCount;
  uint32_t grabCount;
};

struct PullPush {
  uint32_t nodeCount;
  float progressBefore;  // of the tick's motion, at the substep's start
  float progressAfter;
  float substepSeconds;
  float substepRate;  // 1/s
  float caughtUp;     // model::kCaughtUp
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(AttachedRecord) == 32 && sizeof(FrameRecord) == 32 && sizeof(TetherRecord) == 16);
static_assert(sizeof(GrabRecord) == 80 && sizeof(GrabReport) == 16);
}  // namespace clothstream::shared
#endif

#endif
