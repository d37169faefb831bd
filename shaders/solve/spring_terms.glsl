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
// solution if c is 0. b = C + h J v_free, with C the length minus r. With ACAD a spring takes part only if
// v_free would stretch it too far ([Va21] 3.3). The kernels solve for the velocity move / h.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer positions;   // at the substep's start; w: inverse mass
layout(binding = 4) uniform samplerBuffer velocities;  // at the substep's start
layout(binding = 5) uniform samplerBuffer freeVelocities;
layout(binding = 6) uniform samplerBuffer freePositions;
layout(std430, binding = 7) buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 8) buffer Actives {
  uint actives[];  // by chunk: kActive, kPrepared; then the numbers of the active chunks, group by group
};
layout(std430, binding = 9) buffer Groups {
  uint groups[];  // dispatch sizes, three numbers per iteration
};

layout(push_constant) uniform Push {
  PreparePush push;
};

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

End endAt(uint node) {
  vec4 position = texelFetch(positions, int(node));
  return End(position.xyz, position.w, kImplicit ? texelFetch(velocities, int(node)).xyz : vec3(0.0),
             texelFetch(freeVelocities, int(node)).xyz,
             kAdaptive ? texelFetch(freePositions, int(node)).xyz : vec3(0.0));
}

// Springs of one kind and rest length.
struct SpringKind {
  float restLength;
  float elastic;  // h^2 k
  float viscous;  // h d
};

SpringKind springKind(float restLength, float stiffness, float damping) {
  precise float elastic = push.substepSeconds * push.substepSeconds * stiffness;
  precise float viscous = push.substepSeconds * damping;
  return SpringKind(restLength, elastic, viscous);
}

struct Weight {
  float along;  // factor of d d^T
  float across;
  vec3 impulse;  // part of the right-hand side of `here`
  float trace;
};

Weight weightOf(End here, End other, SpringKind kind, ClothRecord cloth, bool exists) {
  precise vec3 d = other.place - here.place;
  precise float squared = max(dotProduct(d, d), 1e-12);
  float inverseLength = reciprocalSquareRoot(squared);
  precise float inverseSquared = inverseLength * inverseLength;
  if (kImplicit) {
    precise vec3 change = other.velocity - here.velocity;
    precise float across = kind.elastic * max(1.0 - kind.restLength * inverseLength, 0.0);
    precise float difference = kind.elastic + kind.viscous - across;
    precise float along = difference > 1e-30 ? difference * inverseSquared : 0.0;
    precise vec3 impulse =
        ((kind.elastic - across) * inverseSquared * dotProduct(d, change)) * d + across * change;
    precise float trace = along * squared + 3.0 * across;
    return Weight(exists ? along : 0.0, exists ? across : 0.0, exists ? impulse : vec3(0.0),
                  exists ? trace : 0.0);
  }
  precise vec3 relative = other.freeVelocity - here.freeVelocity;
  precise float longest = kind.restLength + cloth.activation * kind.restLength;
  // Two pinned nodes do not move.
  precise float inverseMasses = here.inverseMass + other.inverseMass;
  bool isActive =
      exists && inverseMasses > 0.0 && (!kAdaptive || isTooLong(here.freePlace, other.freePlace, longest));
  precise float excess = squared * inverseLength - longest;
  precise float corrected = excess > 0.0 || !kAdaptive ? cloth.correctionFraction * excess : excess;
  precise float side = push.substepRate * corrected + inverseLength * dotProduct(d, relative);
  precise vec3 impulse = (side * inverseLength) * d;
  return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? impulse : vec3(0.0), 0.0);
}

// The start of a node's solve.
struct Start {
  vec4 residual;  // ResidualRecord
  vec3 correction;
  float mass;  // the preconditioner times c M
};

// `impulse` and `trace` are sums over the node's springs. A solve for implicit velocities starts from v' = v.
// If it ends early, it leaves out motion instead of leaving forces without damping.
Start startOf(End here, vec3 impulse, float trace, float compliance) {
  float inverseMass = here.inverseMass;
  float mass = reciprocal(max(inverseMass, 1e-30));
  if (kImplicit) {
    precise vec3 gained = here.freeVelocity - here.velocity;
    precise vec3 residual = mass * gained + impulse;
    precise float diagonal = mass + trace * 0.33333334;
    float preconditioner = reciprocal(diagonal);
    precise float share = mass * preconditioner;
    bool pinned = inverseMass == 0.0;
    return Start(pinned ? vec4(0.0) : vec4(residual, preconditioner), -gained, share);
  }
  return Start(inverseMass == 0.0 ? vec4(0.0) : vec4(impulse, inverseMass), vec3(0.0), compliance);
}

shared uint activeSprings, touched;

void beginChunk() {
  if (self() == 0) {
    activeSprings = touched = 0;
  }
  barrier();
}

// Stores whether a chunk has anything to solve, which follows from all of its nodes. Updates the dispatch
// sizes of the group: of all chunks, of the small systems, of the chunks of large systems. The latter are
// listed in arbitrary order, because it does not matter which workgroup handles which chunk.
void keepActive(System system, uint chunk) {
  barrier();
  if (self() == 0) {
    uint place = system.firstChunk + chunk;
    bool before = kAdaptive && (actives[place] & kActive) != 0;
    actives[place] = (touched != 0 ? kActive | kPrepared : 0) | (before ? kPrepared : 0);
    if (touched != 0 || before) {
      atomicMax(groups[push.firstGroup], push.chunks);
    }
    if (touched != 0 && place < push.firstLargeChunk) {
      atomicMax(groups[push.firstGroup + 3], push.smallSystems);
    }
    if (touched != 0 && place >= push.firstLargeChunk) {
      atomicAdd(solves[system.number].arrived, 0x10000);
      uint listed = atomicAdd(groups[push.firstGroup + 6], 1);
      actives[actives.length() / 2 + push.firstLargeChunk + listed] = place;
    }
  }
}

void keepActiveSprings(System system) {
  barrier();
  if (self() == 0 && activeSprings > 0) {
    atomicAdd(solves[system.number].constraints, activeSprings);
  }
}

#endif
