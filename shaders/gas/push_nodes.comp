// SPDX-License-Identifier: MIT
// Moves the nodes of a cloth by the impulses of the gas inside. Without a stage that follows, they also
// collide.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 3;
const int kStateBinding = 5;
const int kContactImpulseBinding = 8;

#include "shaders/gas/gas.h"
#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
// True if the nodes collide.
layout(constant_id = 1) const bool kCollides = true;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer shares;
layout(binding = 2) uniform samplerBuffer gas;

#include "shaders/shared/end_of_substep.glsl"

layout(push_constant) uniform Push {
  GasPush push;
};

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.nodeCount) {
    return;
  }
  uint index = push.firstNode + node;
  float inverseMass = positions[index].w;
  if (inverseMass == 0.0) {
    return;
  }
  float pressure = texelFetch(gas, int(push.cloth)).z;
  vec3 gradient = texelFetch(shares, int(CLOTHSTREAM_GAS_SHARE_TEXELS * (push.firstRecord + node))).xyz;
  precise vec3 change = ((push.impulse * pressure) * inverseMass) * gradient;
  precise vec3 position = positions[index].xyz + push.substepSeconds * change;
  precise vec3 velocity = velocities[index].xyz + change;
  if (kCollides) {
    endSubstep(index, position, velocity, inverseMass, push.cloth, push.collision);
  } else {
    positions[index].xyz = snapTiny(position);
    velocities[index].xyz = snapTiny(velocity);
  }
}
