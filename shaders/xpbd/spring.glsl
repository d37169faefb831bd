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

// Largest rounding error of the difference of two coordinates of 1.
const float kRounding = 1.2e-7;

// Inverse of the resistance of a spring whose ends have this sum of inverse masses: the denominator of
// [MMC16] Eq. 26.
float inverseResistance(Spring spring, float inverseMasses) {
  precise float resistance = (spring.stretch + spring.damping) * inverseMasses + spring.memory;
  return reciprocal(resistance);
}

// Correction of b divided by its inverse mass; that of a is the negative. `d` leads from a to b; `begun` is
// the same at the substep's start.
//
// The ends move along `begun`, so that the correction leaves the angular momentum as it is, which follows
// from positions at the start and at the end: docs/simulation.md. Along it, the correction acts `gain` times
// as much as along d; the factor (2 - gain) corrects this to second order and never too far. A spring that
// turns by more than about 60 degrees or changes its length by half in one substep is corrected along d.
//
// `place` is where one end is. A difference of lengths below the rounding of such a coordinate counts as
// none: at rest, cloth would otherwise gain energy from the rounding of its positions.
vec3 pullOf(vec3 d, vec3 begun, vec3 place, Spring spring, float inverseResistance, inout float multiplier) {
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise float length_ = squared * inverseLength;
  precise float before = dotProduct(begun, d) * inverseLength;
  precise float rounding = kRounding * (abs(place.x) + abs(place.y) + abs(place.z));
  precise float excess = length_ - spring.restLength;
  precise float beyond = excess - min(max(excess, -rounding), rounding);
  precise float side = spring.stretch * beyond;
  if (kDamped) {
    side = side + spring.damping * (length_ - before);
  }
  if (kIterated) {
    side = side + spring.memory * multiplier;
  }
  precise float step_ = -(side * inverseResistance);
  if (kIterated) {
    precise float sum = multiplier + step_;
    multiplier = sum;
  }
  precise float gain = before * inverseLength;
  precise float strength = step_ * inverseLength;
  precise vec3 pull = (strength * (2.0 - gain)) * begun;
  precise vec3 turned = strength * d;
  return gain > 0.5 && gain < 1.5 ? pull : turned;
}

#endif
