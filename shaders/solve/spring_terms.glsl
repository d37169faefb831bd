// SPDX-License-Identifier: MIT
// What a spring adds to its system.
//
// Implicit Euler: (M + h D + h^2 K) (v' - v) = M (v_free - v) - h^2 K v, with K and D at the substep's start
// (Baraff and Witkin, "Large steps in cloth simulation", 1998). With n from one end to the other, l the
// length and r the rest length,
//   h D + h^2 K = (e + w - a) n n^T + a I,   e = h^2 k,  w = h d,  a = e max(0, 1 - r / l)
// (what pushes across a compressed spring is left out, so that the matrix is positive definite).
//
// Constraints: [Va21] Eq. 3-11 have (J M^-1 J^T + c) lambda = b, and the nodes move by -M^-1 J^T lambda. Put
// lambda = (b + J move) / c into that: (c M + J^T J) move = -J^T b, which has as few unknowns as nodes have
// coordinates, one gather a product, the same eigenvalues, and a solution where c is 0. b = C + h J v_free, C
// the length less r; a spring that may still be a force has no part unless v_free would stretch it too far
// ([Va21] 3.3). Solved for the velocity move / h.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_SPRING_TERMS_GLSL

#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer positions;   // at the substep's start; w: inverse mass
layout(binding = 4) uniform samplerBuffer velocities;  // then
layout(binding = 5) uniform samplerBuffer freeVelocities;
layout(binding = 6) uniform samplerBuffer freePositions;
layout(std430, binding = 7) buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 8) buffer Actives {
  uint actives[];  // a chunk: kActive, kPrepared; then those that are, a group after the other
};
layout(std430, binding = 9) buffer Groups {
  uint groups[];  // three numbers an iteration: how many workgroups it takes
};

layout(push_constant) uniform Push {
  PreparePush push;
};

bool isTooLong(vec3 a, vec3 b, float longest) {
  precise vec3 d = b - a;
  return dotProduct(d, d) > longest * longest;
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

struct Kind {
  float restLength;
  float elastic;  // h^2 k
  float viscous;  // h d
};

struct Weight {
  float along;  // times d d^T
  float across;
  vec3 impulse;  // on `here`: its part of the right-hand side
  float trace;
};

// `limits`: of the cloth's record.
Weight weigh(End here, End other, Kind kind, vec4 limits, bool exists) {
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
  precise float longest = kind.restLength + limits.x * kind.restLength;
  // Between two pinned nodes nothing can move.
  bool isActive = exists && here.inverseMass + other.inverseMass > 0.0 &&
                  (!kAdaptive || isTooLong(here.freePlace, other.freePlace, longest));
  precise float excess = squared * inverseLength - longest;
  precise float correctionFraction = excess > 0.0 || !kAdaptive ? limits.y * excess : excess;
  precise float side = push.substepRate * correctionFraction + inverseLength * dotProduct(d, relative);
  precise vec3 impulse = (side * inverseLength) * d;
  return Weight(isActive ? inverseSquared : 0.0, 0.0, isActive ? impulse : vec3(0.0), 0.0);
}

// What a node starts its solve with.
struct Start {
  vec4 residual;
  vec3 correction;
  float mass;  // the preconditioner times c M
};

// `impulse`, `trace`: sums over the node's springs. Implicit velocities are solved for from v' = v on, so
// that a solve that ends early leaves motion out rather than forces unbraked.
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

// Whether a chunk has anything to solve, by all of its nodes; and how many workgroups there are then of the
// group's chunks, of its small systems, of the large ones' chunks. Those are listed, in whatever order: it
// does not matter who does which.
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
