// SPDX-License-Identifier: MIT
// Finds the balls of each list that touch its ball, and lists the balls that touch any. It also copies the
// state, which the kernel that resolves contacts reads while it overwrites the original.
//
// The order of the touching balls is arbitrary: no ball depends on the place of another. Other writes cannot
// race: each node belongs to one invocation.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kMaterialBinding = 0;

#include "shaders/self_collision/neighbours.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 2) uniform samplerBuffer neighbours;  // kNeighbourStride floats per node
layout(binding = 3) uniform samplerBuffer positions;   // w: inverse mass
layout(binding = 4) uniform samplerBuffer velocities;
layout(std430, binding = 5) writeonly buffer Positions {
  vec4 contactPositions[];
};
layout(std430, binding = 6) writeonly buffer Velocities {
  vec4 contactVelocities[];  // w: number of balls that it touches
};
layout(std430, binding = 7) writeonly buffer Contacts {
  float contacts[];  // kMaxContacts per node
};
layout(std430, binding = 8) writeonly buffer Touching {
  uint touching[];
};
layout(std430, binding = 9) buffer Groups {
  ContactGroups groups;
};
layout(std430, binding = 10) buffer Report {
  CrowdReport report;
};

layout(push_constant) uniform Push {
  ContactPush push;
};

void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount || !isBall(restAt(rests, node))) {
    return;
  }
  vec4 here = texelFetch(positions, int(node));
  int texel = int(node * (kNeighbourStride / 4));
  NeighbourHead head = neighbourHeadAt(neighbours, texel);
  int end = texel + (int(head.count) + 3) / 4;
  Material own = Material(head.radius, head.friction);
  uint first = node * kMaxContacts;
  uint count = 0;
  while (texel < end) {
    ++texel;
    vec4 four = texelFetch(neighbours, texel);
    [[unroll]] for (int k = 0; k < 4; ++k) {
      uint other = nodeOf(four[k], node);
      float distance = bothOf(own, four[k], other).radius;
      precise vec3 apart = here.xyz - texelFetch(positions, int(other)).xyz;
      precise float limit = distance * distance;
      if (dotProduct(apart, apart) < limit) {
        if (count < kMaxContacts) {
          contacts[first + count] = four[k];
        }
        ++count;
      }
    }
  }
  contactPositions[node] = here;
  contactVelocities[node] = vec4(texelFetch(velocities, int(node)).xyz, float(count));
  if (count > 0 && here.w > 0.0) {
    uint place = atomicAdd(groups.touching, 1u);
    touching[place] = node;
    atomicMax(groups.x, place / gl_WorkGroupSize.x + 1);
  }
  if (count > kMaxContacts) {
    atomicAdd(report.balls, 1u);
  }
  for (uint i = count; i < kMaxContacts && (i & 3u) != 0; ++i) {
    contacts[first + i] = 0.0;
  }
}
