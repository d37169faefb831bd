// SPDX-License-Identifier: MIT
// Gives each attached node, which no force moves, the velocity that takes it to its place at the tick's end.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/attachment/attachment.h"
#include "shaders/shared/rotation.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer attached;  // AttachedRecord
layout(binding = 1) uniform samplerBuffer frames;    // FrameRecord
layout(binding = 2) uniform samplerBuffer positions;
layout(std430, binding = 3) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  AimPush push;
};

// Writes cannot race: no node is attached twice.
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) {
    return;
  }
  AttachedRecord record = attachedAt(attached, i);
  int node = int(record.node);
  FrameRecord frame = frameAt(frames, uint(record.frame));
  precise vec3 place = frame.position + rotate(frame.orientation, record.place);
  precise vec3 velocity = push.tickRate * (place - texelFetch(positions, node).xyz);
  precise float squared = dotProduct(velocity, velocity);
  precise float mostSquared = push.maxSpeed * push.maxSpeed;
  if (squared > mostSquared) {
    precise vec3 slower = velocity * (push.maxSpeed * reciprocalSquareRoot(squared));
    velocity = slower;
  }
  velocities[node].xyz = snapTiny(velocity);
}
