// SPDX-License-Identifier: MIT
// The transpose of J times the multipliers (SpMVT, [Va21] 3.2.2) takes every node from where the forces alone
// took it; then it collides. Every node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

const int kColliderBinding = 4;
const int kStateBinding = 6;
const int kContactImpulseBinding = 10;

#include "shaders/assembled/assembled.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer cloths;   // ClothRecord
layout(binding = 1) uniform samplerBuffer ranges;   // NodeRangeRecord
layout(binding = 2) uniform samplerBuffer entries;  // EntriesRecord, a node: a column of J
layout(binding = 3) uniform samplerBuffer rows;     // NumbersRecord
layout(binding = 9) uniform samplerBuffer blocks;   // fill_jacobian.comp
layout(binding = 11) uniform samplerBuffer states;  // rows.glsl

// Reads `cloths`.
#include "shaders/shared/end_of_substep.glsl"

layout(push_constant) uniform Push {
  ApplyMultiplierPush push;
};

vec3 pullOn(uint node) {
  vec4 range = texelFetch(entries, int(node));
  int end = int(range.y);
  precise vec3 pull = vec3(0.0);
  for (int texel = int(range.x); texel < end; ++texel) {
    vec4 four = texelFetch(rows, texel);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      int entry = int(max(four[i], 0.0));
      precise vec3 part = texelFetch(states, entry / 2).w * texelFetch(blocks, entry).xyz;
      pull = pull + (four[i] < 0.0 ? vec3(0.0) : part);
    }
  }
  return pull;
}

void main() {
  vec4 part = texelFetch(ranges, int(gl_WorkGroupID.x));
  uint node = uint(part.y) + gl_LocalInvocationID.x;
  uint end = uint(part.z);
  for (; node < end; node += gl_WorkGroupSize.x) {
    vec4 free = positions[node];
    precise vec3 change = -(free.w * pullOn(node));
    precise vec3 position = free.xyz + push.substepSeconds * change;
    precise vec3 velocity = velocities[node].xyz + change;
    endSubstep(node, position, velocity, free.w, CLOTHSTREAM_CLOTH_TEXELS * int(part.x), push.collision);
  }
}
