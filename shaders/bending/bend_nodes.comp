// SPDX-License-Identifier: MIT
// Adds the velocity that the hinges at a node give it in a substep. Bending comes before everything else in a
// substep.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/bending/bending.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/whole_number.h"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer incidences;  // ListRecord by node
layout(binding = 1) uniform samplerBuffer lists;       // HingeNumbers
layout(binding = 2) uniform samplerBuffer forces;      // four per hinge
layout(binding = 3) uniform samplerBuffer positions;   // w: inverse mass
layout(std430, binding = 4) buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  BendingPush push;
};

vec3 forceOf(float number) {
  vec3 force = texelFetch(forces, int(max(number, 1.0)) - 1).xyz;
  return number == 0.0 ? vec3(0.0) : force;
}

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint node = gl_GlobalInvocationID.x;
  if (node >= push.count) {
    return;
  }
  TexelRange list = rangeOf(listAt(incidences, node));
  float inverseMass = texelFetch(positions, int(node)).w;
  if (list.first == list.end || inverseMass == 0.0) {
    return;
  }
  precise vec3 sum = vec3(0.0);
  while (list.first < list.end) {
    vec4 four = texelFetch(lists, list.first);
    sum = sum + forceOf(four.x);
    sum = sum + forceOf(four.y);
    sum = sum + forceOf(four.z);
    sum = sum + forceOf(four.w);
    ++list.first;
  }
  precise vec3 velocity = velocities[node].xyz + (push.substepSeconds * inverseMass) * sum;
  velocities[node].xyz = snapTiny(velocity);
}
