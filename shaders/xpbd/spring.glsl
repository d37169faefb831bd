// SPDX-License-Identifier: MIT
// One correction of one spring: [MMC16] Macklin, Müller and Chentanez, "XPBD", Motion in Games 2016, Eq. 17,
// 18, 26.
#ifndef CLOTHSTREAM_SHADERS_XPBD_SPRING_GLSL
#define CLOTHSTREAM_SHADERS_XPBD_SPRING_GLSL

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// What a kernel leaves out where no cloth needs it; the bits are the same.
layout(constant_id = 1) const bool kDamped = true;
// Whether some cloth's springs are corrected more than once in a substep. Only then do multipliers outlive
// it.
layout(constant_id = 2) const bool kIterated = true;

// As scene::XpbdSpring.
struct Spring {
  float stretch;
  float damping;
  float memory;
  float restLength;
};

Spring springFrom(vec4 record, float restLength) {
  return Spring(record.x, record.y, record.z, restLength);
}

// 1 / (what a spring with ends of these inverse masses in all resists with).
float inverseResistance(Spring spring, float inverseMasses) {
  precise float resistance = (spring.stretch + spring.damping) * inverseMasses + spring.memory;
  return reciprocal(resistance);
}

// What b goes by, times its inverse mass, and a by its negative. `d`: from a to b; `begun`: likewise at the
// substep's start.
vec3 pullOf(vec3 d, vec3 begun, Spring spring, float inverseResistance, inout float multiplier) {
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise float length_ = squared * inverseLength;
  precise float side = spring.stretch * (length_ - spring.restLength);
  if (kDamped) {
    side = side + spring.damping * (length_ - dotProduct(begun, d) * inverseLength);
  }
  if (kIterated) {
    side = side + spring.memory * multiplier;
  }
  precise float step_ = -(side * inverseResistance);
  if (kIterated) {
    precise float sum = multiplier + step_;
    multiplier = sum;
  }
  precise vec3 pull = (step_ * inverseLength) * d;
  return pull;
}

#endif
