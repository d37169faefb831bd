// SPDX-License-Identifier: MIT
// The multipliers' effect on every node that has constraints, [Va21] Eq. 8; then its collisions.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 6;

#include "shaders/collision/collide.glsl"
#include "shaders/constraint/incidence.glsl"
#include "shaders/mass_spring/node.glsl"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 5) readonly buffer Multipliers {
  float multipliers[];
};
layout(binding = 8) uniform samplerBuffer startPositions;  // of the substep
layout(std430, binding = 9) buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 10) buffer Velocities {
  vec4 velocities[];
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
  uint firstLink = wholeNumber(place.x, place.y);
  int record = CLOTHSTREAM_CLOTH_TEXELS * int(place.w);
  vec4 start = positions[index];
  Node node = Node(start.xyz, start.w, velocities[index].xyz);
  if (node.inverseMass > 0.0 && incidence.z > 0.0) {
    vec3 force;
    GATHER(force, incidence, firstLink, MULTIPLIER)
    precise vec3 move = -node.inverseMass * force;
    precise vec3 position = node.position + move;
    precise vec3 velocity = node.velocity + push.substepRate * move;
    node.position = position;
    node.velocity = velocity;
  }
  float friction = texelFetch(cloths, record + 2).w;
  float thickness = texelFetch(cloths, record + 3).w;
  if (node.inverseMass > 0.0 && push.collision.colliderCount > 0) {
    collideWithAll(index, push.collision, thickness, friction, texelFetch(startPositions, int(index)).xyz,
                   node.position, node.velocity);
  }
  positions[index] = vec4(snapTiny(node.position), start.w);
  velocities[index] = vec4(snapTiny(node.velocity), 0.0);
}
