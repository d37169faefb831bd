// SPDX-License-Identifier: MIT
// Moves a node by the corrections of coarse nodes, as far as colliders allow. The way becomes velocity.
#ifndef CLOTHSTREAM_SHADERS_COARSE_MOVE_GLSL
#define CLOTHSTREAM_SHADERS_COARSE_MOVE_GLSL

const int kColliderBinding = 6;
const int kContactImpulseBinding = 8;

#include "shaders/coarse/coarse.h"
#include "shaders/collision/collide.glsl"
#include "shaders/shared/arithmetic.glsl"

// True if the tick has a collider. Software devices run the kernel four times as fast without this code.
layout(constant_id = 1) const bool kColliders = true;

layout(binding = 0) uniform
    samplerBuffer shares;  // of meshes: two CoarseShare per texel, two texels per node
layout(binding = 1) uniform samplerBuffer corrections;
layout(binding = 2) uniform samplerBuffer presentPositions;  // w: inverse mass
layout(binding = 3) uniform samplerBuffer presentVelocities;
layout(std430, binding = 4) writeonly buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 5) writeonly buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  CoarsePush push;
};

// Correction of a coarse node of the cloth.
vec3 correctionAt(int coarse) {
  return texelFetch(corrections, int(push.firstCoarse) + coarse).xyz;
}

// Pinned nodes stay.
void moveNode(uint node, vec3 move) {
  vec4 start = texelFetch(presentPositions, int(node));
  if (start.w == 0.0 || move == vec3(0.0)) {
    return;
  }
  precise vec3 position = start.xyz + move;
  vec3 way = move;
  if (kColliders) {
    // An inverse mass and a friction of 0: the contact is not reported, and the way loses only its part into
    // a surface.
    CollidingNode colliding = CollidingNode(node, 0, 0.0, push.thickness, 0.0);
    collideWithAll(colliding, push.collision, start.xyz, position, way);
  }
  precise vec3 velocity = texelFetch(presentVelocities, int(node)).xyz + push.velocityRate * way;
  positions[node] = vec4(snapTiny(position), start.w);
  velocities[node] = vec4(snapTiny(velocity), 0.0);
}

#endif
