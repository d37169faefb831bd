// SPDX-License-Identifier: MIT
// The correction of one spring: [MMC16] Macklin, Müller and Chentanez, "XPBD", Motion in Games 2016, Eq. 17,
// 18, 26.
#ifndef CLOTHSTREAM_SHADERS_XPBD_SPRING_GLSL
#define CLOTHSTREAM_SHADERS_XPBD_SPRING_GLSL

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// False leaves out code that no cloth needs; the bits are the same.
layout(constant_id = 1) const bool kDamped = true;
// True if a cloth's springs are corrected more than once per substep. Only then are the multipliers stored.
layout(constant_id = 2) const bool kIterated = true;

// model::XpbdSpring and a rest length.
struct Spring {
  float stretch;
  float damping;
  float memory;
  float restLength;
};

Spring springFrom(XpbdSpringRecord record, float restLength) {
  return Spring(record.stretch, record.damping, record.memory, restLength);
}

// Inverse of the resistance of a spring whose ends have this sum of inverse masses: the denominator of
// [MMC16] Eq. 26.
float inverseResistance(Spring spring, float inverseMasses) {
  precise float resistance = (spring.stretch + spring.damping) * inverseMasses + spring.memory;
  return reciprocal(resistance);
}

// Correction of b divided by its inverse mass; that of a is the negative. `d` leads from a to b; `begun` is
// the same at the substep's start.
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
