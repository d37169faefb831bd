// SPDX-License-Identifier: MIT
// Contact distance and friction of a pair of balls.
//
// The including kernel defines kMaterialBinding, the first of two bindings.
#ifndef CLOTHSTREAM_SHADERS_SELF_COLLISION_NEIGHBOURS_GLSL
#define CLOTHSTREAM_SHADERS_SELF_COLLISION_NEIGHBOURS_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/self_collision/self_collision.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// True if balls have different radii or frictions. False saves looking up the material of other cloths.
layout(constant_id = 1) const bool kSeveralMaterials = true;

layout(binding = kMaterialBinding) uniform samplerBuffer cloths;     // ClothRecord
layout(binding = kMaterialBinding + 1) uniform samplerBuffer rests;  // RestRecord

struct Material {
  float radius;
  float friction;
};

// Node of a signed number in a list of the ball `own`.
uint nodeOf(float number, uint own) {
  return number == 0.0 ? own : uint(abs(number)) - 1;
}

// Distance at which a pair touches (0 if there is no other ball), and its mean friction.
Material bothOf(Material own, float number, uint node) {
  Material other = own;
  if (kSeveralMaterials) {
    ClothRecord cloth = clothAt(cloths, clothOf(restAt(rests, node)));
    other = Material(number < 0.0 ? cloth.ballRadius : own.radius,
                     number < 0.0 ? cloth.ballFriction : own.friction);
  }
  precise float distance = own.radius + other.radius;
  precise float friction = 0.5 * (own.friction + other.friction);
  return Material(number == 0.0 ? 0.0 : distance, friction);
}

#endif
