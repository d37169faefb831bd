// SPDX-License-Identifier: MIT
// The terms that a spring adds to its linear system.
//
// Implicit Euler: (M + h D + h^2 K) (v' - v) = M (v_free - v) - h^2 K v, with K and D at the substep's start
// (Baraff and Witkin, "Large steps in cloth simulation", 1998). With n from one end to the other, l the
// length and r the rest length,
//   h D + h^2 K = (e + w - a) n n^T + a I,   e = h^2 k,  w = h d,  a = e max(0, 1 - r / l)
// (the part that pushes across a compressed spring is left out, so that the matrix is positive definite).
//
// Constraints: [Va21] Eq. 3-11 have (J M^-1 J^T + c) lambda = b, and the nodes move by -M^-1 J^T lambda.
// Substituting lambda = (b + J move) / c gives (c M + J^T J) move = -J^T b. This system has only as many
// unknowns as the nodes have coordinates, needs one gather per product, has the same eigenvalues, and has a
// solution if c is 0. b = C + h J v_free, with C the length minus r. The kernels solve for the velocity
// move / h.
//
// ACAD as the paper has it: a spring takes part if it is too long at the substep's start. v_free is without
// its force, and C is (l^2 - r^2) / (2 l), the paper's Eq. 3 divided by the length of its Jacobian's row.
//
// ACAD's limit: u minimises c u M u / 2 + sum of max(0, C(x_free + h u) / h)^2 / 2, with C the length minus
// the longest. The multiplier max(0, C) / c pulls and never pushes. A round is a step of Newton's method: it
// linearises C where the last round led, and solves for the change of u,
//   (c M + J^T J) change = -c M u - J^T max(0, C) / h.
//
// The including kernel declares the push constants substepSeconds and substepRate.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_SPRING_WEIGHT_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_SPRING_WEIGHT_GLSL

#include "shaders/solve/linear_system.glsl"

// Implicit Euler: a spring that is longer than this many rest lengths has an additional dashpot. It grows by
// kCalmSeconds times the stiffness for each further rest length.
const float kOverlong = 1.1, kCalmSeconds = 0.1;

bool isTooLong(vec3 a, vec3 b, float longest) {
  precise vec3 d = b - a;
  precise float squared = longest * longest;
  return dotProduct(d, d) > squared;
}

struct End {
  vec3 place;
  float inverseMass;
  vec3 velocity;
  vec3 freeVelocity;
  vec3 freePlace;
};

// Springs of one kind and rest length.
struct SpringKind {
  float restLength;
  float elastic;  // h^2 k
  float viscous;  // h d
  float calm;     // h kCalmSeconds k / r
};

SpringKind springKind(float restLength, float stiffness, float damping) {
  precise float elastic = push.substepSeconds * push.substepSeconds * stiffness;
  precise float viscous = push.substepSeconds * damping;
  precise float calm = kCalmSeconds * push.substepSeconds * stiffness * reciprocal(max(restLength, 1e-6));
  return SpringKind(restLength, elastic, viscous, calm);
}

struct Weight {
  float along;  // factor of d d^T
  float across;
  vec3 impulse;  // part of the right-hand side of `here`
};

Weight weightOf(End here, End other, SpringKind kind, ClothRecord cloth, bool exists) {
  precise vec3 d = other.place - here.place;
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise float inverseSquared = inverseLength * inverseLength;
  if (kImplicit) {
    precise vec3 change = other.velocity - here.velocity;
    precise float across = kind.elastic * max(1.0 - kind.restLength * inverseLength, 0.0);
    precise float overlong = max(squared * inverseLength - kOverlong * kind.restLength, 0.0);
    precise float stiff = kind.elastic + kind.calm * overlong;
    precise float difference = stiff + kind.viscous - across;
    precise float along = difference > 1e-30 ? difference * inverseSquared : 0.0;
    precise vec3 impulse = ((stiff - across) * inverseSquared * dotProduct(d, change)) * d + across * change;
    return Weight(exists ? along : 0.0, exists ? across : 0.0, exists ? impulse : vec3(0.0));
  }
  precise vec3 relative = other.freeVelocity - here.freeVelocity;
  precise float longest = kind.restLength + cloth.activation * kind.restLength;
  // Two pinned nodes do not move.
  precise float inverseMasses = here.inverseMass + other.inverseMass;
  bool isActive =
      exists && inverseMasses > 0.0 && (!kAdaptive || isTooLong(here.freePlace, other.freePlace, longest));
  if (kPaper) {
    // Half of the paper's constraint l^2 - r^2 and of its Jacobian: Eq. 3 and 5.
    precise float half_ = 0.5 * cloth.correctionFraction * (squared - kind.restLength * kind.restLength);
    precise float paperSide = (push.substepRate * half_ + dotProduct(d, relative)) * inverseSquared;
    precise vec3 paperImpulse = paperSide * d;
    return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? paperImpulse : vec3(0.0));
  }
  if (kLimit) {
    precise float limitSide = push.substepRate * (squared * inverseLength - longest);
    precise vec3 limitImpulse = (limitSide * inverseLength) * d;
    return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? limitImpulse : vec3(0.0));
  }
  precise float excess = cloth.correctionFraction * (squared * inverseLength - kind.restLength);
  precise float side = push.substepRate * excess + inverseLength * dotProduct(d, relative);
  precise vec3 impulse = (side * inverseLength) * d;
  return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? impulse : vec3(0.0));
}

// The start of a node's solve.
struct Start {
  vec4 residual;  // ResidualRecord
  vec3 correction;
};

// `impulse` is the sum over the node's springs. A solve for implicit velocities starts from v' = v. If it
// ends early, it leaves out motion instead of leaving forces without damping. `total` is the solution of the
// rounds before. The masses are the preconditioner, so that residuals of the forces between nodes add up to
// nothing in every iteration: a solve that ends early makes no momentum.
Start startOf(End here, vec3 impulse, float compliance, vec3 total) {
  float inverseMass = here.inverseMass;
  float mass = reciprocal(max(inverseMass, 1e-30));
  if (kImplicit) {
    precise vec3 gained = here.freeVelocity - here.velocity;
    precise vec3 residual = mass * gained + impulse;
    return Start(inverseMass == 0.0 ? vec4(0.0) : vec4(residual, inverseMass), -gained);
  }
  precise vec3 residual = kLimit ? impulse - (compliance * mass) * total : impulse;
  return Start(inverseMass == 0.0 ? vec4(0.0) : vec4(residual, inverseMass), vec3(0.0));
}

#endif
