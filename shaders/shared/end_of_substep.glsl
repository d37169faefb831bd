// SPDX-License-Identifier: MIT
// The end of a node's substep where a solver has taken it: there it collides.
//
// The kernel that includes this defines kColliderBinding, kContactImpulseBinding and, from kStateBinding on, binds the
// positions at the substep's start, then the positions and velocities that it ends with. `cloths` are its
// ClothRecords.
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

// `record`: the first texel of its cloth.
void endSubstep(uint index, vec3 position, vec3 velocity, float inverseMass, int record, CollisionPush push) {
  if (inverseMass > 0.0 && push.colliderCount > 0) {
    CollidingNode who = CollidingNode(uint(record) / CLOTHSTREAM_CLOTH_TEXELS, inverseMass);
    collideWithAll(index, who, push, texelFetch(cloths, record + 3).w, texelFetch(cloths, record + 2).w,
                   texelFetch(startPositions, int(index)).xyz, position, velocity);
  }
  positions[index] = vec4(snapTiny(position), inverseMass);
  velocities[index] = vec4(snapTiny(velocity), 0.0);
}

#endif
