// SPDX-License-Identifier: MIT
// The multipliers' effect on every node that has constraints, [Va21] Eq. 8; then its collisions.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 6;
const int kStateBinding = 8;

#include "shaders/constraint/incidence.glsl"
#include "shaders/shared/end_of_substep.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 5) readonly buffer Multipliers {
  float multipliers[];
};

layout(push_constant) uniform Push {
  ConstraintPush push;
};

#define MULTIPLIER(link) multipliers[link]

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) {
    return;
  }
  vec4 incidence = texelFetch(incidences, int(index));
  if (incidence.w == 0.0) {
    return;
  }
  vec4 place = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * (int(incidence.w) - 1));
  float inverseMass = positions[index].w;
  precise vec3 position = positions[index].xyz;
  precise vec3 velocity = velocities[index].xyz;
  if (inverseMass > 0.0) {
    vec3 force;
    GATHER(force, incidence, wholeNumber(place.x, place.y), MULTIPLIER)
    precise vec3 move = -inverseMass * force;
    position = position + move;
    velocity = velocity + push.substepRate * move;
  }
  endSubstep(index, position, velocity, inverseMass, CLOTHSTREAM_CLOTH_TEXELS * int(place.w), push.collision);
}
