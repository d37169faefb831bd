// SPDX-License-Identifier: MIT
// The velocity with which an attached node, which no force moves, is in its place at the tick's end.
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
  vec4 node = texelFetch(attached, 2 * int(i));
  int frame = 2 * int(node.y);
  vec3 inFrame = texelFetch(attached, 2 * int(i) + 1).xyz;
  precise vec3 place = texelFetch(frames, frame).xyz + rotate(texelFetch(frames, frame + 1), inFrame);
  precise vec3 velocity = push.tickRate * (place - texelFetch(positions, int(node.x)).xyz);
  precise float squared = dotProduct(velocity, velocity);
  if (squared > push.maxSpeed * push.maxSpeed) {
    precise vec3 slower = velocity * (push.maxSpeed * reciprocalSquareRoot(squared));
    velocity = slower;
  }
  velocities[int(node.x)].xyz = snapTiny(velocity);
}
