// SPDX-License-Identifier: MIT
// The force of a damped spring, [Va21] Eq. 1.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_SPRINGS_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_SPRINGS_GLSL

#include "shaders/mass_spring/node.glsl"
#include "shaders/shared/arithmetic.glsl"

// Whether any cloth's springs are damped. Where none is, neighbours' velocities need not be read; the bits
// are the same, for the damping term is then zero.
layout(constant_id = 2) const bool kSpringDamping = true;

// Whether any spring is a force at all.
layout(constant_id = 6) const bool kSpringForces = true;

struct Spring {
  float stiffness;
  float damping;
  float restLength;
};

// A spring that is not there pulls with zero, whatever lies at its other end.
Spring where(bool exists, Spring spring) {
  return Spring(exists ? spring.stiffness : 0.0, exists ? spring.damping : 0.0, spring.restLength);
}

// On `node`, from the spring to `other`; not finite where an end is not. Exactly the negative of the force on
// `other`: swapping the two negates differences, and nothing else.
vec3 springForce(Node node, Node other, Spring spring) {
  if (!kSpringForces) {
    return vec3(0.0);
  }
  precise vec3 d = other.position - node.position;
  precise float inverseLength = reciprocalSquareRoot(max(dotProduct(d, d), 1e-12));
  precise float scale = spring.stiffness * (1.0 - spring.restLength * inverseLength);
  if (kSpringDamping) {
    precise vec3 relative = other.velocity - node.velocity;
    scale = scale + (spring.damping * dotProduct(relative, d)) * (inverseLength * inverseLength);
  }
  precise vec3 force = scale * d;
  return force;
}

#endif
