// SPDX-License-Identifier: MIT
// Computes where the joints take the nodes of a cloth during a tick. Nodes that follow their joints exactly,
// which no force moves, get the velocity that takes them there. Writes cannot race: each node and each limit
// belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/cloth_skin/skinned_node.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 2) uniform samplerBuffer positions;
layout(std430, binding = 3) buffer Velocities {
  vec4 velocities[];
};
layout(std430, binding = 4) writeonly buffer Limits {
  vec4 limits[];  // LimitRecord
};

layout(push_constant) uniform Push {
  PlacePush push;
};

// A vector of length 1 in the direction of a blended normal.
vec3 unitOf(vec3 normal) {
  precise float squared = max(dotProduct(normal, normal), 1e-12);
  precise vec3 unit_ = normal * reciprocalSquareRoot(squared);
  return unit_;
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.limitedCount + push.exactCount) {
    return;
  }
  int record = CLOTHSTREAM_SKINNED_TEXELS * int(push.firstRecord + i);
  vec4 rest = texelFetch(skinned, record), normal = texelFetch(skinned, record + 1),
       joints = texelFetch(skinned, record + 2);
  Influences by = influencesAt(record, joints);
  Transform start = blended(by, int(push.firstJoint)),
            end = blended(by, int(push.firstJoint + push.jointCount));
  vec3 place = moved(end, rest.xyz);
  int node = int(rest.w);
  if (i >= push.limitedCount) {
    precise vec3 velocity = push.tickRate * (place - texelFetch(positions, node).xyz);
    velocities[node].xyz = snapTiny(velocity);
    return;
  }
  vec3 before = moved(start, rest.xyz);
  precise vec3 motion = place - before;
  vec3 facing = unitOf(turned(start, normal.xyz));
  precise vec3 turn = unitOf(turned(end, normal.xyz)) - facing;
  int limit = CLOTHSTREAM_LIMIT_TEXELS * int(push.firstLimit + i);
  limits[limit] = vec4(before, normal.w);
  limits[limit + 1] = vec4(motion, rest.w);
  limits[limit + 2] = vec4(facing, joints.z);
  limits[limit + 3] = vec4(turn, joints.w);
}
