// SPDX-License-Identifier: MIT
// Tables and push constants of attachments, tethers and grabs. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_ATTACHMENT_ATTACHMENT_H
#define CLOTHSTREAM_SHADERS_ATTACHMENT_ATTACHMENT_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// A node that follows a frame.
#define CLOTHSTREAM_ATTACHED_TEXELS 2
struct AttachedRecord {
  float node;  // in the scene
  float frame;
  float reserved0, reserved1;
  vec3 place;  // in the frame, m
  float reserved2;
};

// The pose of a frame at the tick's end.
#define CLOTHSTREAM_FRAME_TEXELS 2
struct FrameRecord {
  vec3 position;  // m
  float reserved;
  vec4 orientation;  // unit quaternion
};

// A limit on the distance of a node from a node that forces do not move.
struct TetherEnd {
  float anchor;    // node in the scene plus one; 0: no tether
  float distance;  // m
};

// The tethers of a node; the shorter one first.
struct TetherRecord {
  TetherEnd ends[2];
};

// Values of GrabRecord::state.
const float kReleasedGrab = 0;  // releases all of its nodes
const float kActiveGrab = 1;
const float kBeginningGrab = 2;         // grabs nodes at this tick's start
const float kBeginningGrabAtPlace = 3;  // the same, near a point of the cloth instead of its position

// A grab during one tick.
#define CLOTHSTREAM_GRAB_TEXELS 7
struct GrabRecord {
  vec3 position;           // at the tick's start
  float squaredSlip;       // m^2; a node slips away beyond this squared distance
  vec3 motion;             // displacement during the tick
  float force;             // N, at most
  vec4 orientation;        // unit quaternion at the tick's start
  vec4 orientationChange;  // difference of the quaternions during the tick
  float state;             // one of the values above
  float squaredRadius;     // m^2
  float squaredReach;      // m^2
  float left;              // part of GrabReport::offset that is left at the tick's start
  vec3 nodes;              // of kBeginningGrabAtPlace: its point is the weighted mean of three nodes
  float leftChange;        // change of `left` during the tick
  vec3 weights;
  float reserved;
};

// A node's place in the grab that has it.
struct GrabbedNode {
  vec3 place;     // in the grab, m
  float grabber;  // number of the grab plus one; 0: no grab has the node
};

// Result of a grab.
struct GrabReport {
  uint32_t nearest;  // bits of the squared distance of the nearest node when the grab began
  uint32_t grabbed;  // nodes that it grabbed
  uint32_t slipped;  // grabbed nodes that slipped away
  uint32_t reserved0;
  vec3 offset;  // from the grab's position to its point when it began, m; 0 without a point
  float reserved1;
};

// The rigid motion of a cloth's nodes from one pose to another.
struct CarryPush {
  vec3 from;  // m
  uint32_t firstNode;
  vec3 to;  // m
  uint32_t nodeCount;
  vec4 fromOrientation, toOrientation;  // unit quaternions
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
  float progressBefore;  // share of the tick's motion at the substep's start
  float progressAfter;
  float substepSeconds;
  float substepRate;  // 1/s
  float caughtUp;     // model::kGrabCorrectionFraction
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(AttachedRecord) == CLOTHSTREAM_ATTACHED_TEXELS * sizeof(vec4) &&
              offsetof(AttachedRecord, place) == 16);
static_assert(sizeof(FrameRecord) == CLOTHSTREAM_FRAME_TEXELS * sizeof(vec4) && sizeof(TetherRecord) == 16);
static_assert(sizeof(GrabRecord) == CLOTHSTREAM_GRAB_TEXELS * sizeof(vec4) &&
              offsetof(GrabRecord, orientation) == 32 && offsetof(GrabRecord, state) == 64 &&
              offsetof(GrabRecord, weights) == 96);
static_assert(sizeof(GrabbedNode) == 16 && sizeof(GrabReport) == 32 && offsetof(GrabReport, offset) == 16);
}  // namespace clothstream::shared
#else

AttachedRecord attachedAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_ATTACHED_TEXELS * int(number);
  vec4 node = texelFetch(table, first);
  vec4 place = texelFetch(table, first + 1);
  return AttachedRecord(CLOTHSTREAM_FLOATS(node), CLOTHSTREAM_VECTOR(place));
}

FrameRecord frameAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_FRAME_TEXELS * int(number);
  vec4 position = texelFetch(table, first);
  return FrameRecord(CLOTHSTREAM_VECTOR(position), texelFetch(table, first + 1));
}

TetherRecord tetherAt(samplerBuffer table, uint node) {
  vec4 texel = texelFetch(table, int(node));
  return TetherRecord(TetherEnd[2](TetherEnd(texel.x, texel.y), TetherEnd(texel.z, texel.w)));
}

GrabRecord grabAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_GRAB_TEXELS * int(number);
  vec4 start = texelFetch(table, first);
  vec4 motion = texelFetch(table, first + 1);
  vec4 state = texelFetch(table, first + 4);
  vec4 nodes = texelFetch(table, first + 5);
  vec4 weights = texelFetch(table, first + 6);
  return GrabRecord(CLOTHSTREAM_VECTOR(start), CLOTHSTREAM_VECTOR(motion), texelFetch(table, first + 2),
                    texelFetch(table, first + 3), CLOTHSTREAM_FLOATS(state), CLOTHSTREAM_VECTOR(nodes),
                    CLOTHSTREAM_VECTOR(weights));
}

#endif

#endif
