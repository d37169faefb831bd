// SPDX-License-Identifier: MIT
// The state that a substep reads and the one that it writes, and a node's step from one to the other.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_STATE_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_STATE_GLSL

const int kColliderBinding = 6;
const int kContactImpulseBinding = 8;

#include "shaders/collision/collide.glsl"
#include "shaders/mass_spring/air.glsl"
#include "shaders/mass_spring/springs.glsl"
#include "shaders/shared/simulation.h"

// Whether there is a collider at all.
layout(constant_id = 4) const bool kColliders = true;
// As in [Va21]; else semi-implicit Euler.
layout(constant_id = 5) const bool kExplicitEuler = false;

layout(binding = 2) uniform samplerBuffer positions;  // w: inverse mass
layout(binding = 3) uniform samplerBuffer velocities;
layout(std430, binding = 4) writeonly buffer NextPositions {
  vec4 nextPositions[];
};
layout(std430, binding = 5) writeonly buffer NextVelocities {
  vec4 nextVelocities[];
};

layout(push_constant) uniform Push {
  AdvancePush push;
};

vec3 fetchVelocity(uint index) {
  return texelFetch(velocities, int(index)).xyz;
}

// The velocity of a neighbour is read where some force depends on it.
Node fetchNode(uint index) {
  vec4 position = texelFetch(positions, int(index));
  return Node(position.xyz, position.w, kSpringDamping || kAir ? fetchVelocity(index) : vec3(0.0));
}

void store(uint index, Node node) {
  nextPositions[index] = vec4(snapTiny(node.position), node.inverseMass);
  nextVelocities[index] = vec4(snapTiny(node.velocity), 0.0);
}

// By all forces on it and its own decay, one over seconds; `node` has its velocity. No force moves
// a pinned node: it goes on at its velocity, which is 0 but where it is attached to something that moves.
Node moveNode(Node node, vec3 force, float decay) {
  precise vec3 acceleration = force * node.inverseMass + push.gravityStep.xyz - decay * node.velocity;
  precise vec3 velocity = node.velocity + push.gravityStep.w * acceleration;
  velocity = node.inverseMass == 0.0 ? node.velocity : velocity;
  precise vec3 position = node.position + push.gravityStep.w * (kExplicitEuler ? node.velocity : velocity);
  return Node(position, node.inverseMass, velocity);
}

#endif
