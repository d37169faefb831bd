// SPDX-License-Identifier: MIT
// Separates all touching balls at once. Then they collide with the scene's colliders again, which have
// priority.
//
// A ball that touches n others counts as n balls with a share of its mass each, one per contact, and gets the
// mean of their changes (Tonge, Benevolenski, Voroshilov, "Mass Splitting for Jitter-Free Parallel Rigid Body
// Simulation", 2012). This converges for any heap, and both sides of a pair get the same impulse. The impulse
// stops the approach and corrects a share of the overlap; Coulomb friction acts within its share of the
// impulse. Positions follow velocities, so that no ball gains unneeded speed and balls at rest stay at rest.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kMaterialBinding = 0;
const int kColliderBinding = 2;
const int kContactImpulseBinding = 12;

#include "shaders/collision/collide.glsl"
#include "shaders/self_collision/neighbours.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 4) uniform samplerBuffer contacts;           // kMaxContacts floats per node
layout(binding = 5) uniform samplerBuffer contactPositions;   // w: inverse mass
layout(binding = 6) uniform samplerBuffer contactVelocities;  // w: number of balls that it touches
layout(binding = 7) uniform samplerBuffer startPositions;     // at the substep's start
layout(std430, binding = 8) readonly buffer Touching {
  uint touching[];
};
layout(std430, binding = 9) readonly buffer Groups {
  ContactGroups groups;
};
layout(std430, binding = 10) writeonly buffer Positions {
  vec4 positions[];
};
layout(std430, binding = 11) writeonly buffer Velocities {
  vec4 velocities[];
};

layout(push_constant) uniform Push {
  ContactPush push;
};

// Impulse in m/s for one share of inverse mass. Both sides of a pair compute the same value with opposite
// signs.
vec3 contactImpulse(vec3 apart, float squared, vec3 relative, float touching, float friction, bool above) {
  float inverse = reciprocalSquareRoot(max(squared, 1e-20));
  precise vec3 direction = apart * inverse;
  vec3 normal = squared < 1e-16 ? vec3(0.0, above ? 1.0 : -1.0, 0.0) : direction;
  precise float overlap = touching - squared * inverse;
  precise float wanted = push.correctionRate * overlap;
  float separation = dotProduct(relative, normal);
  precise float along = (wanted < push.pushOutSpeed ? wanted : push.pushOutSpeed) - separation;
  float pressed = max(along, 0.0);
  precise vec3 slip = relative - separation * normal;
  float inverseSlip = reciprocalSquareRoot(max(dotProduct(slip, slip), 1e-30));
  precise float held = friction * pressed * inverseSlip;
  precise vec3 impulse = pressed * normal - (held < 1.0 ? held : 1.0) * slip;
  return impulse;
}

// Writes cannot race: each node belongs to one invocation, and reads go to other buffers.
void main() {
  if (gl_GlobalInvocationID.x >= groups.touching) {
    return;
  }
  uint node = touching[gl_GlobalInvocationID.x];
  vec4 here = texelFetch(contactPositions, int(node));
  vec4 moving = texelFetch(contactVelocities, int(node));
  uint number = clothOf(restAt(rests, node));
  ClothRecord cloth = clothAt(cloths, number);
  Material own = Material(cloth.ballRadius, cloth.ballFriction);
  precise float ownShare = moving.w * here.w;
  precise vec3 sum = vec3(0.0);
  int texel = int(node * (kMaxContacts / 4));
  int end = texel + int(min(uint(moving.w), kMaxContacts) + 3) / 4;
  while (texel < end) {
    vec4 four = texelFetch(contacts, texel);
    [[unroll]] for (int k = 0; k < 4; ++k) {
      uint other = nodeOf(four[k], node);
      Material both = bothOf(own, four[k], other);
      vec4 there = texelFetch(contactPositions, int(other));
      vec4 otherMoving = texelFetch(contactVelocities, int(other));
      precise vec3 apart = here.xyz - there.xyz;
      precise vec3 relative = moving.xyz - otherMoving.xyz;
      precise float shares = ownShare + otherMoving.w * there.w;
      vec3 impulse =
          contactImpulse(apart, dotProduct(apart, apart), relative, both.radius, both.friction, node > other);
      sum = sum + (four[k] == 0.0 ? vec3(0.0) : reciprocal(shares) * impulse);
    }
    ++texel;
  }
  precise vec3 change = here.w * sum;
  precise vec3 velocity = moving.xyz + change;
  precise vec3 position = here.xyz + push.substepSeconds * change;
  if (push.collision.colliderCount > 0) {
    CollidingNode collidingNode = CollidingNode(node, number, here.w, cloth.thickness, cloth.friction);
    collideWithAll(collidingNode, push.collision, texelFetch(startPositions, int(node)).xyz, position,
                   velocity);
  }
  positions[node] = vec4(snapTiny(position), here.w);
  velocities[node] = vec4(snapTiny(velocity), 0.0);
}
