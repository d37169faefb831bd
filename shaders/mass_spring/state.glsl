// SPDX-License-Identifier: MIT
// The state that a substep reads, the state that it writes, and the step of a node between them.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_STATE_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_STATE_GLSL

const int kColliderBinding = 6;
const int kContactImpulseBinding = 8;

#include "shaders/collision/collide.glsl"
#include "shaders/mass_spring/air.glsl"
#include "shaders/mass_spring/springs.glsl"
#include "shaders/shared/simulation.h"

// True if the tick has a collider.
layout(constant_id = 4) const bool kColliders = true;
// True: explicit Euler as in [Va21]. False: semi-implicit Euler.
layout(constant_id = 5) const bool kExplicitEuler = false;

// The forces decide from the motion whether a spring may become too long.
const bool kTestsMotion = kTestsStretch && !kOmitsStretched;

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

// Reads the velocity of a neighbour only if a force depends on it.
Node fetchNode(uint index) {
  vec4 position = texelFetch(positions, int(index));
  bool moves = kSpringDamping || kAir;
  return Node(position.xyz, position.w, moves ? fetchVelocity(index) : vec3(0.0));
}

void store(uint index, Node node) {
  nextPositions[index] = vec4(snapTiny(node.position), node.inverseMass);
  nextVelocities[index] = vec4(snapTiny(node.velocity), 0.0);
}

// Moves a node by the force on it and by the decay of its velocity, 1/s. No force moves a pinned node: it
// keeps its velocity, which is 0 unless the node is attached to a moving frame.
Node moveNode(Node node, vec3 force, float decay) {
  precise vec3 acceleration = force * node.inverseMass + push.gravity - decay * node.velocity;
  precise vec3 velocity = node.velocity + push.stepSeconds * acceleration;
  velocity = node.inverseMass == 0.0 ? node.velocity : velocity;
  precise vec3 position = node.position + push.stepSeconds * (kExplicitEuler ? node.velocity : velocity);
  return Node(position, node.inverseMass, velocity);
}

#endif
