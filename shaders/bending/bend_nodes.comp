// SPDX-License-Identifier: MIT
// The velocity that the hinges round a node give it in a substep, before everything else moves it.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/bending/bending.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/whole_number.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer incidences;  // HingeListRecord
layout(binding = 1) uniform samplerBuffer lists;
layout(binding = 2) uniform samplerBuffer forces;     // four a hinge
layout(binding = 3) uniform samplerBuffer positions;  // w: inverse mass
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
  vec4 list = texelFetch(incidences, int(node));
  float inverseMass = texelFetch(positions, int(node)).w;
  if (list.z == 0.0 || inverseMass == 0.0) {
    return;
  }
  int texel = int(wholeNumber(list.x, list.y));
  int end = texel + int(list.z);
  precise vec3 sum = vec3(0.0);
  while (texel < end) {
    vec4 four = texelFetch(lists, texel);
    sum = sum + forceOf(four.x);
    sum = sum + forceOf(four.y);
    sum = sum + forceOf(four.z);
    sum = sum + forceOf(four.w);
    ++texel;
  }
  precise vec3 velocity = velocities[node].xyz + (push.substepSeconds * inverseMass) * sum;
  velocities[node].xyz = snapTiny(velocity);
}
