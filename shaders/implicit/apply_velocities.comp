// SPDX-License-Identifier: MIT
// Implicit Euler's velocities take every node of its cloths from where the forces alone took it.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 6;
const int kStateBinding = 8;

#include "shaders/implicit/incidence.glsl"
#include "shaders/shared/end_of_substep.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 5) readonly buffer Corrections {
  vec4 corrections[];
};

layout(push_constant) uniform Push {
  ConstraintPush push;
};

void main() {
  uint index = gl_GlobalInvocationID.x;
  if (index >= push.count) {
    return;
  }
  vec4 incidence = texelFetch(incidences, int(index));
  if (incidence.w == 0.0) {
    return;
  }
  vec3 correction = corrections[index].xyz;
  precise vec3 position = positions[index].xyz + push.substepSeconds * correction;
  precise vec3 velocity = velocities[index].xyz + correction;
  int cloth = int(texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * (int(incidence.w) - 1)).w);
  endSubstep(index, position, velocity, positions[index].w, CLOTHSTREAM_CLOTH_TEXELS * cloth, push.collision);
}
