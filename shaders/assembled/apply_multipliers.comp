// SPDX-License-Identifier: MIT
// Moves every node by the transpose of J times the multipliers (SpMVT, [Va21] 3.2.2), starting from the free
// motion that the forces alone give. Then the node collides. Every node belongs to one invocation.
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
layout(binding = 2) uniform samplerBuffer entries;  // EntriesRecord by node: columns of J
layout(binding = 3) uniform samplerBuffer rows;     // NumbersRecord
layout(binding = 9) uniform samplerBuffer blocks;   // fill_jacobian.comp
layout(binding = 11) uniform samplerBuffer states;  // rows.glsl

#include "shaders/shared/end_of_substep.glsl"

layout(push_constant) uniform Push {
  ApplyMultiplierPush push;
};

vec3 pullOn(uint node) {
  EntriesRecord range = entriesAt(entries, node);
  int end = int(range.endTexel);
  precise vec3 pull = vec3(0.0);
  for (int texel = int(range.firstTexel); texel < end; ++texel) {
    vec4 four = texelFetch(rows, texel);
    [[unroll]] for (int i = 0; i < 4; ++i) {
      int entry = int(max(four[i], 0.0));
      float multiplier = rowStateFrom(texelFetch(states, entry / 2)).multiplier;
      precise vec3 part = multiplier * jacobianBlockAt(blocks, uint(entry)).gradient;
      pull = pull + (four[i] < 0.0 ? vec3(0.0) : part);
    }
  }
  return pull;
}

void main() {
  NodeRangeRecord range = nodeRangeAt(ranges, gl_WorkGroupID.x);
  uint node = uint(range.firstNode) + gl_LocalInvocationID.x;
  uint end = uint(range.endNode);
  for (; node < end; node += gl_WorkGroupSize.x) {
    vec4 free = positions[node];
    precise vec3 change = -(free.w * pullOn(node));
    precise vec3 position = free.xyz + push.substepSeconds * change;
    precise vec3 velocity = velocities[node].xyz + change;
    endSubstep(node, position, velocity, free.w, uint(range.cloth), push.collision);
  }
}
