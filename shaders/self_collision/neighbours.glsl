// SPDX-License-Identifier: MIT
// What two balls have in common that may touch.
//
// The kernel that includes this defines kMaterialBinding, the first of two bindings.
#ifndef CLOTHSTREAM_SHADERS_SELF_COLLISION_NEIGHBOURS_GLSL
#define CLOTHSTREAM_SHADERS_SELF_COLLISION_NEIGHBOURS_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/self_collision/self_collision.h"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// Whether balls are of several sizes or frictions: else those of another cloth need not be looked up.
layout(constant_id = 1) const bool kSeveralMaterials = true;

layout(binding = kMaterialBinding) uniform samplerBuffer cloths;     // ClothRecord
layout(binding = kMaterialBinding + 1) uniform samplerBuffer rests;  // w: cloth + 1; 0: no ball

struct Material {
  float radius;
  float friction;
};

// What `number` stands for in a list of the ball `own`.
uint nodeOf(float number, uint own) {
  return number == 0.0 ? own : uint(abs(number)) - 1;
}

// Of a pair: the distance at which they touch, 0 where there is no other; and their mean friction.
Material bothOf(Material own, float number, uint node) {
  Material other = own;
  if (kSeveralMaterials) {
    vec4 record =
        texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * (int(texelFetch(rests, int(node)).w) - 1) + 4);
    other = Material(number < 0.0 ? record.z : own.radius, number < 0.0 ? record.w : own.friction);
  }
  precise float distance = own.radius + other.radius;
  precise float friction = 0.5 * (own.friction + other.friction);
  return Material(number == 0.0 ? 0.0 : distance, friction);
}

#endif
