// SPDX-License-Identifier: MIT
// The force of a damped spring, [Va21] Eq. 1.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_SPRINGS_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_SPRINGS_GLSL

#include "shaders/mass_spring/node.glsl"
#include "shaders/shared/arithmetic.glsl"

// True if any cloth has damped springs. False saves reading the neighbours' velocities. The bits are the
// same, because the damping term is then zero.
layout(constant_id = 2) const bool kSpringDamping = true;

// True if any spring acts as a force.
layout(constant_id = 6) const bool kSpringForces = true;

// True: springs longer than their limit have no force. ACAD's constraints replace them, [Va21] Fig. 5.
layout(constant_id = 7) const bool kOmitsStretched = false;

struct Spring {
  float stiffness;
  float damping;
  float restLength;
  float longestSquared;  // square of the limit, with kOmitsStretched
};

// ACAD: the kernel finds out whether a spring may become longer than its limit.
layout(constant_id = 8) const bool kTestsStretch = false;

// A length that no spring reaches.
const float kNoLimit = 1e18;

// Longest length of a spring with a force, squared. solve/spring_weight.glsl computes the same bits.
float longestSquared(float restLength, float activation, bool limited) {
  precise float longest = restLength + activation * restLength;
  precise float squared = longest * longest;
  return limited ? squared : kNoLimit;
}

// A spring that does not exist pulls with zero, independent of its other end.
Spring where(bool exists, Spring spring) {
  return Spring(exists ? spring.stiffness : 0.0, exists ? spring.damping : 0.0, spring.restLength,
                spring.longestSquared);
}

// Force on `node` of the spring to `other`. It is not finite if an end is not finite. It is exactly the
// negative of the force on `other`, because swapping the two only negates differences.
vec3 springForce(Node node, Node other, Spring spring) {
  if (!kSpringForces) {
    return vec3(0.0);
  }
  precise vec3 d = other.position - node.position;
  precise float squared = dotProduct(d, d);
  precise float inverseLength = reciprocalSquareRoot(max(squared, 1e-12));
  precise float scale = spring.stiffness * (1.0 - spring.restLength * inverseLength);
  if (kSpringDamping) {
    precise vec3 relative = other.velocity - node.velocity;
    scale = scale + (spring.damping * dotProduct(relative, d)) * (inverseLength * inverseLength);
  }
  precise vec3 force = scale * d;
  return kOmitsStretched && squared > spring.longestSquared ? vec3(0.0) : force;
}

#endif
