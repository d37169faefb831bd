// SPDX-License-Identifier: MIT
// The end of a node's substep after its solver moved it: the node collides and is stored.
//
// The including kernel declares the table `cloths` and defines kColliderBinding, kContactImpulseBinding and
// kStateBinding. From kStateBinding on it binds the positions at the substep's start, then the positions and
// velocities at its end.
#ifndef CLOTHSTREAM_SHADERS_SHARED_END_OF_SUBSTEP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_END_OF_SUBSTEP_GLSL

#include "shaders/collision/collide.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

layout(binding = kStateBinding) uniform samplerBuffer startPositions;
layout(std430, binding = kStateBinding + 1) buffer Positions {
  vec4 positions[];
};
layout(std430, binding = kStateBinding + 2) buffer Velocities {
  vec4 velocities[];
};

void endSubstep(uint index, vec3 position, vec3 velocity, float inverseMass, uint cloth, CollisionPush push) {
  if (inverseMass > 0.0 && push.colliderCount > 0) {
    ClothRecord material = clothAt(cloths, cloth);
    CollidingNode node = CollidingNode(index, cloth, inverseMass, material.thickness, material.friction);
    collideWithAll(node, push, texelFetch(startPositions, int(index)).xyz, position, velocity);
  }
  positions[index] = vec4(snapTiny(position), inverseMass);
  velocities[index] = vec4(snapTiny(velocity), 0.0);
}

#endif
