// SPDX-License-Identifier: MIT
// Takes the nodes of a cloth along when its joints jump: each keeps its place relative to its skinned place,
// and its velocity, turned with the joints. Writes cannot race: each node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/cloth_skin/skinned_node.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 2) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 3) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  SkinJumpPush push;
};

// The mean of the turns of the joints by the weights.
vec3 turnedAlong(Influences by, vec3 v) {
  precise vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    vec3 still = turnedBack(transformAt(int(push.firstBefore) + by.joints[k]), v);
    sum = sum + by.weights[k] * turned(transformAt(int(push.firstAfter) + by.joints[k]), still);
  }
  return sum;
}

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= push.count) {
    return;
  }
  int record = CLOTHSTREAM_SKINNED_TEXELS * int(push.firstRecord + i);
  vec4 rest = texelFetch(skinned, record);
  Influences by = influencesAt(record, texelFetch(skinned, record + 2));
  int node = int(rest.w);
  precise vec3 away = positions[node].xyz - moved(blended(by, int(push.firstBefore)), rest.xyz);
  precise vec3 position = moved(blended(by, int(push.firstAfter)), rest.xyz) + turnedAlong(by, away);
  positions[node].xyz = snapTiny(position);
  velocities[node].xyz = snapTiny(turnedAlong(by, velocities[node].xyz));
}
