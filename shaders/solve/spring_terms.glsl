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
//
// ACAD as the paper has it: a spring takes part if it is too long at the substep's start. v_free is without
// its force, and C is (l^2 - r^2) / (2 l), the paper's Eq. 3 divided by the length of its Jacobian's row.
//
// ACAD's limit: u minimises c u M u / 2 + sum of max(0, C(x_free + h u) / h)^2 / 2, with C the length minus
// the longest. The multiplier max(0, C) / c pulls and never pushes. A round is a step of Newton's method: it
// linearises C where the last round led, and solves for the change of u,
//   (c M + J^T J) change = -c M u - J^T max(0, C) / h.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer positions;  // at the substep's start; w: inverse mass
// With kLimit: `freePositions`.
layout(binding = 4) uniform samplerBuffer velocities;  // at the substep's start
layout(binding = 5) uniform samplerBuffer freeVelocities;
layout(binding = 6) uniform samplerBuffer freePositions;  // with kPaper: `positions`
layout(std430, binding = 7) buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 8) buffer Actives {
  // Three numbers a chunk, group by group: its flags, then the active chunks of large systems, then the
  // prepared chunks.
  uint actives[];
};
layout(std430, binding = 9) buffer Groups {
  uint groups[];  // dispatch sizes, three numbers each: SolveStage
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
  if (kPaper) {
    // Half of the paper's constraint l^2 - r^2 and of its Jacobian: Eq. 3 and 5.
    precise float half_ = 0.5 * cloth.correctionFraction * (squared - kind.restLength * kind.restLength);
    precise float paperSide = (push.substepRate * half_ + dotProduct(d, relative)) * inverseSquared;
    precise vec3 paperImpulse = paperSide * d;
    return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? paperImpulse : vec3(0.0), 0.0);
  }
  if (kLimit) {
    precise float limitSide = push.substepRate * (squared * inverseLength - longest);
    precise vec3 limitImpulse = (limitSide * inverseLength) * d;
    return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? limitImpulse : vec3(0.0), 0.0);
  }
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
// If it ends early, it leaves out motion instead of leaving forces without damping. `total` is the solution
// of the rounds before.
Start startOf(End here, vec3 impulse, float trace, float compliance, vec3 total) {
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
  precise vec3 residual = kLimit ? impulse - (compliance * mass) * total : impulse;
  return Start(inverseMass == 0.0 ? vec4(0.0) : vec4(residual, inverseMass), vec3(0.0), compliance);
}

shared uint activeSprings, touched;

void beginChunk() {
  if (self() == 0) {
    activeSprings = touched = 0;
  }
  barrier();
}

// True if the round before solved the chunk. Such a chunk stays in the solve, because springs that are no
// longer active must give back what they did.
bool isContinued(System system, uint chunk) {
  return kLimit && push.round > 0 && (actives[system.firstChunk + chunk] & kActive) != 0;
}

// Stores whether a chunk has anything to solve, which follows from all of its nodes. Updates the dispatch
// sizes of the group: of the prepared chunks, of the small systems, of all chunks in the next round, of the
// active chunks of large systems. Chunks are listed in arbitrary order, because it does not matter which
// workgroup handles which chunk.
void keepActive(System system, uint chunk) {
  barrier();
  if (self() == 0) {
    uint place = system.firstChunk + chunk;
    bool before = kAdaptive && (actives[place] & kActive) != 0;
    bool continued = isContinued(system, chunk);
    bool active_ = touched != 0 || continued;
    actives[place] =
        (active_ ? kActive | kPrepared : 0) | (before ? kPrepared : 0) | (continued ? kContinued : 0);
    if (active_ || before) {
      uint listed = atomicAdd(groups[push.firstGroup], 1);
      actives[2 * (actives.length() / 3) + push.firstChunk + listed] = place;
    }
    if (active_) {
      atomicMax(groups[push.firstGroup + 6], push.chunks);
    }
    if (active_ && place < push.firstLargeChunk) {
      atomicMax(groups[push.firstGroup + 3], push.smallSystems);
    }
    if (active_ && place >= push.firstLargeChunk) {
      atomicAdd(solves[system.number].arrived, 0x10000);
      uint listed = atomicAdd(groups[push.firstGroup + 9], 1);
      actives[actives.length() / 3 + push.firstLargeChunk + listed] = place;
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
