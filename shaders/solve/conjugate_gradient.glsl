// SPDX-License-Identifier: MIT
// The two halves of an iteration of conjugate gradients. The first half multiplies the matrix by the
// preconditioned residuals and computes the dot products. The second half takes the step. The preconditioner
// is one number per node.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_CONJUGATE_GRADIENT_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_CONJUGATE_GRADIENT_GLSL

#include "shaders/shared/conjugate_gradient_step.glsl"
#include "shaders/solve/linear_system.glsl"

// True: every node of a walk has its own invocation, so that a GPU has four times as many, each with few
// registers. False: an invocation walks down, and neighbours stay in registers. The bits are the same.
layout(constant_id = 6) const bool kSpread = false;
const uint kRows = kSpread ? 1 : kWalk;  // nodes of a walk that an invocation handles
const uint kParts = kWalk / kRows;       // invocations that share a walk

layout(binding = 3) uniform samplerBuffer positions;   // as in spring_terms.glsl
layout(binding = 4) uniform samplerBuffer incidences;  // ListRecord by node of a mesh
layout(binding = 5) uniform samplerBuffer lists;       // SpringEndsRecord
layout(binding = 6) uniform samplerBuffer along;       // SpringWeights of a grid, WeightedSprings of a mesh
layout(binding = 7) uniform samplerBuffer across;      // SpringWeights of an implicit grid
// The same memory twice: a software device reads texels three times as fast as storage and writes storage
// five times as fast as texels.
layout(binding = 8, rgba32f) uniform coherent readonly imageBuffer texels;
layout(std430, binding = 9) coherent buffer Vectors {
  vec4 vectors[];
};
layout(std430, binding = 10) coherent buffer Sums {
  vec2 chunkSums[];  // by chunk: residual . z, z . A z,  with z the preconditioned residual
};
layout(std430, binding = 11) coherent buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 12) readonly buffer Actives {
  uint actives[];  // spring_terms.glsl
};

layout(push_constant) uniform Push {
  SolvePush push;
};

uint vectorAt(uint which, uint node) {
  return which * push.nodes + node;
}
vec4 fetch(uint which, uint node) {
  return imageLoad(texels, int(vectorAt(which, node)));
}

ResidualRecord residualAt(uint node) {
  return residualFrom(fetch(kResiduals, node));
}

struct Point {
  vec3 place;
  vec3 z;  // preconditioned residual
  ResidualRecord own;
};

Point pointAt(uint node) {
  ResidualRecord own = residualAt(node);
  precise vec3 z = own.preconditioner * own.residual;
  return Point(texelFetch(positions, int(node)).xyz, z, own);
}

// Term of a spring at `here`; at `other` it is the exact negative.
vec3 pull(Point here, Point other, float along, float across) {
  precise vec3 d = other.place - here.place;
  precise vec3 relative = here.z - other.z;
  precise vec3 force = (along * dotProduct(d, relative)) * d;
  if (kImplicit) {
    force = force + across * relative;
  }
  return force;
}

// Stores A z of a node. Returns what the node adds to the sums.
vec2 keepProduct(uint node, Point here, vec3 product) {
  precise vec3 kept = here.own.preconditioner > 0.0 ? product : vec3(0.0);
  vectors[vectorAt(kProducts, node)].xyz = kept;
  precise vec2 sums = vec2(dotProduct(here.own.residual, here.z), dotProduct(here.z, kept));
  return sums;
}

const SpringWeights kNoWeights = SpringWeights(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);

SpringWeights weightsAt(samplerBuffer table, bool exists, uint node) {
  SpringWeights weights = springWeightsAt(table, node);
  return SpringWeights(exists ? weights.right : 0.0, exists ? weights.below : 0.0,
                       exists ? weights.rightBelow : 0.0, exists ? weights.rightToBelow : 0.0,
                       exists ? weights.secondRight : 0.0, exists ? weights.secondBelow : 0.0,
                       exists ? weights.mass : 0.0, 0.0);
}

SpringWeights alongAt(bool exists, uint node) {
  return weightsAt(along, exists, node);
}
SpringWeights acrossAt(bool exists, uint node) {
  if (kImplicit) {
    return weightsAt(across, exists, node);
  }
  return kNoWeights;
}

// A point in the window, or of `node` if there is no window. Then it is read just before the term that needs
// it, so that a GPU needs fewer registers.
Point pointOf(Point window, uint node) {
  if (kSpread) {
    return pointAt(node);
  }
  return window;
}

// Walks down a column with a window of registers, as in shaders/mass_spring. Springs beyond an edge have no
// weight, and loads beyond an edge read the edge instead.
vec2 multiplyGrid(System system, Walk walk) {
  uint columns = system.columns;
  uint lastRow = system.rows - 1;
  bool hasLeft = walk.column > 0;
  bool hasLeft2 = walk.column > 1;
  uint toLeft = hasLeft ? 1 : 0;
  uint toLeft2 = hasLeft2 ? 2 : 0;
  uint toRight = walk.column + 1 < columns ? 1 : 0;
  uint toRight2 = walk.column + 2 < columns ? 2 : 0;
  uint start = system.firstNode + walk.column;

  uint row = walk.row;
  bool hasAbove = row > 0;
  uint index = start + row * columns;
  uint aboveIndex = start + (hasAbove ? row - 1 : 0) * columns;
  uint above2Index = start + (row > 1 ? row - 2 : 0) * columns;
  uint belowIndex = start + min(row + 1, lastRow) * columns;
  Point leftAbove, rightAbove, left, right, below;
  if (!kSpread) {
    leftAbove = pointAt(aboveIndex - toLeft);
    rightAbove = pointAt(aboveIndex + toRight);
    left = pointAt(index - toLeft);
    right = pointAt(index + toRight);
    below = pointAt(belowIndex);
  }
  Point above = pointAt(aboveIndex);
  Point here = pointAt(index);
  SpringWeights aboveAlong = alongAt(hasAbove, aboveIndex);
  SpringWeights aboveAcross = acrossAt(hasAbove, aboveIndex);
  SpringWeights leftAboveAlong = alongAt(hasAbove && hasLeft, aboveIndex - toLeft);
  SpringWeights leftAboveAcross = acrossAt(hasAbove && hasLeft, aboveIndex - toLeft);
  SpringWeights above2Along = alongAt(row > 1, above2Index);
  SpringWeights above2Across = acrossAt(row > 1, above2Index);
  vec3 aboveForce = pull(here, above, aboveAlong.below, aboveAcross.below);
  vec3 above2Force, nextAbove2Force;
  if (kBend) {
    above2Force = pull(here, pointAt(above2Index), above2Along.secondBelow, above2Across.secondBelow);
    if (!kSpread) {
      nextAbove2Force = pull(below, above, aboveAlong.secondBelow, aboveAcross.secondBelow);
    }
  }

  precise vec2 sums = vec2(0.0);
  [[unroll]] for (uint k = 0; k < kRows; ++k) {
    index = start + min(row, lastRow) * columns;
    belowIndex = start + min(row + 1, lastRow) * columns;
    Point below2 = pointAt(start + min(row + 2, lastRow) * columns);
    SpringWeights own = alongAt(true, index);
    SpringWeights ownAcross = acrossAt(true, index);
    SpringWeights ofLeft = alongAt(hasLeft, index - toLeft);
    SpringWeights ofLeftAcross = acrossAt(hasLeft, index - toLeft);

    below = pointOf(below, belowIndex);
    vec3 belowForce = pull(here, below, own.below, ownAcross.below);
    precise vec3 sum = own.mass * here.own.residual;
    left = pointOf(left, index - toLeft);
    sum = sum + pull(here, left, ofLeft.right, ofLeftAcross.right);
    right = pointOf(right, index + toRight);
    sum = sum + pull(here, right, own.right, ownAcross.right);
    sum = sum + aboveForce;
    sum = sum + belowForce;
    leftAbove = pointOf(leftAbove, aboveIndex - toLeft);
    sum = sum + pull(here, leftAbove, leftAboveAlong.rightBelow, leftAboveAcross.rightBelow);
    rightAbove = pointOf(rightAbove, aboveIndex + toRight);
    sum = sum + pull(here, rightAbove, aboveAlong.rightToBelow, aboveAcross.rightToBelow);
    Point leftBelow = pointAt(belowIndex - toLeft);
    sum = sum + pull(here, leftBelow, ofLeft.rightToBelow, ofLeftAcross.rightToBelow);
    Point rightBelow = pointAt(belowIndex + toRight);
    sum = sum + pull(here, rightBelow, own.rightBelow, ownAcross.rightBelow);
    if (kBend) {
      float left2Along = alongAt(hasLeft2, index - toLeft2).secondRight;
      float left2Across = acrossAt(hasLeft2, index - toLeft2).secondRight;
      vec3 below2Force = pull(here, below2, own.secondBelow, ownAcross.secondBelow);
      sum = sum + pull(here, pointAt(index - toLeft2), left2Along, left2Across);
      sum = sum + pull(here, pointAt(index + toRight2), own.secondRight, ownAcross.secondRight);
      sum = sum + above2Force;
      sum = sum + below2Force;
      above2Force = nextAbove2Force;
      nextAbove2Force = -below2Force;
    }
    if (row <= lastRow) {
      sums = sums + keepProduct(index, here, sum);
    }

    aboveForce = -belowForce;
    leftAbove = left;
    rightAbove = right;
    left = leftBelow;
    right = rightBelow;
    here = below;
    below = below2;
    aboveAlong = own;
    aboveAcross = ownAcross;
    leftAboveAlong = ofLeft;
    leftAboveAcross = ofLeftAcross;
    ++row;
  }
  return sums;
}

// Multiplies the matrix of a mesh by gathering the springs that meet at each node.
vec2 multiplyMesh(System system, Walk walk) {
  float factor = massFactor(clothAt(cloths, system.cloth));
  precise vec2 sums = vec2(0.0);
  for (uint k = 0; k < kRows; ++k) {
    uint node = walk.first + min(k, max(walk.count, 1) - 1);
    Point here = pointAt(node);
    precise vec3 sum = factor * here.own.residual;
    TexelRange list = rangeOf(listAt(incidences, node));
    while (list.first < list.end) {
      SpringEndsRecord two = springEndsAt(lists, list.first);
      [[unroll]] for (int i = 0; i < 2; ++i) {
        float number = two.ends[i].signedSpring;
        uint spring = system.firstSpring + uint(max(abs(number), 1.0)) - 1;
        ResidualRecord other = residualAt(uint(two.ends[i].other));
        WeightedSpring weighted = weightedSpringAt(along, spring);
        precise vec3 relative = here.z - other.preconditioner * other.residual;
        precise vec3 part = dotProduct(weighted.row, relative) * weighted.row;
        if (kImplicit) {
          part = part + weighted.across * relative;
        }
        sum = sum + (number == 0.0 ? vec3(0.0) : part);
      }
      ++list.first;
    }
    if (k < walk.count) {
      sums = sums + keepProduct(node, here, sum);
    }
  }
  return sums;
}

uint lanesOf(System system, uint chunk) {
  return (actives[system.firstChunk + chunk] & kActive) == 0 ? 0 : kLanes;
}

// Sums of the parts of all walks of a chunk.
shared vec2 parts[kSpread ? kLanes * kWalk : 1];

// Places of a chunk: its lanes, part by part.
uint placesOf(System system, uint chunk) {
  return kParts * lanesOf(system, chunk);
}

// The nodes of a place.
Walk partAt(System system, uint chunk, uint place) {
  Walk walk = walkAt(system, chunk * kLanes + place % kLanes);
  if (!kSpread) {
    return walk;
  }
  uint part = place / kLanes;
  uint step_ = min(part, max(walk.count, 1) - 1);
  walk.row += kMesh ? 0 : step_;
  walk.first += step_ * walk.step;
  walk.count = part < walk.count ? 1 : 0;
  return walk;
}

void keepPart(uint place, vec2 sums) {
  if (kSpread) {
    parts[place] = sums;
  } else {
    lanes[place] = sums;
  }
}

// Adds the parts of each walk in their order. A part without nodes adds zero.
void addParts() {
  barrier();
  for (uint lane = self(); lane < kLanes; lane += width()) {
    precise vec2 sums = vec2(0.0);
    [[unroll]] for (uint part = 0; part < kParts; ++part) {
      sums = sums + parts[part * kLanes + lane];
    }
    lanes[lane] = sums;
  }
}

void keepSums(System system, uint chunk) {
  if (kSpread) {
    addParts();
  }
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    chunkSums[system.firstChunk + chunk] = sums;
  }
}

// Computes a chunk's part of A z and of the sums.
void multiplyChunk(System system, uint chunk) {
  uint end = placesOf(system, chunk);
  uint place = self();
  do {
    Walk walk = partAt(system, chunk, place);
    vec2 sums = vec2(0.0);
    if (walk.count > 0 && place < end) {
      sums = kMesh ? multiplyMesh(system, walk) : multiplyGrid(system, walk);
    }
    keepPart(place, sums);
    place += width();
  } while (place < end);
  keepSums(system, chunk);
}

// Measures only the residual's norm.
void measureChunk(System system, uint chunk) {
  uint end = placesOf(system, chunk);
  uint place = self();
  do {
    Walk walk = partAt(system, chunk, place);
    precise vec2 sums = vec2(0.0);
    [[unroll]] for (uint k = 0; k < kRows; ++k) {
      if (k < walk.count && place < end) {
        ResidualRecord own = residualAt(walk.first + k * walk.step);
        precise vec3 z = own.preconditioner * own.residual;
        sums.x = sums.x + dotProduct(own.residual, z);
      }
    }
    keepPart(place, sums);
    place += width();
  } while (place < end);
  keepSums(system, chunk);
}

// The chunk of a workgroup if several workgroups solve a system.
ChunkRecord ownChunk() {
  return chunkAt(chunks, actives[actives.length() / 3 + push.firstChunk + gl_WorkGroupID.x]);
}

// Decides whether to continue, and by which step, after all chunks have their sums. One workgroup calls this.
void takeSums(System system, bool normOnly) {
  for (uint lane = self(); lane < kLanes; lane += width()) {
    precise vec2 sum = vec2(0.0);
    for (uint chunk = system.firstChunk + lane; chunk < system.firstChunk + system.chunks; chunk += kLanes) {
      sum = sum + ((actives[chunk] & kActive) == 0 ? vec2(0.0) : chunkSums[chunk]);
    }
    lanes[lane] = sum;
  }
  vec2 sums = sumOfLanes();
  if (self() != 0) {
    return;
  }
  SolveRecord solve = measured(solves[system.number], sums.x, clothAt(cloths, system.cloth), normOnly);
  if (solve.running != 0) {
    solve = stepped(solve, sums);
  }
  solves[system.number] = solve;
}

// Takes the step at the nodes of a chunk.
void updateChunk(System system, uint chunk, SolveRecord solve) {
  uint end = solve.running == 0 ? 0 : placesOf(system, chunk);
  bool first = solve.iterations == 1;
  uint place = self();
  do {
    Walk walk = partAt(system, chunk, place);
    [[unroll]] for (uint k = 0; k < kRows; ++k) {
      uint node = walk.first + min(k, max(walk.count, 1) - 1) * walk.step;
      ResidualRecord before = residualAt(node);
      vec3 oldDirection = first ? vec3(0.0) : fetch(kDirections, node).xyz;
      vec3 oldImage = first ? vec3(0.0) : fetch(kImages, node).xyz;
      precise vec3 direction = before.preconditioner * before.residual + solve.directionShare * oldDirection;
      precise vec3 image = fetch(kProducts, node).xyz + solve.directionShare * oldImage;
      precise vec3 residual = before.residual - solve.stepLength * image;
      precise vec3 correction = fetch(kCorrections, node).xyz + solve.stepLength * direction;
      precise vec3 total = kLimit ? fetch(kTotals, node).xyz + solve.stepLength * direction : vec3(0.0);
      if (k < walk.count && place < end) {
        vectors[vectorAt(kDirections, node)].xyz = direction;
        vectors[vectorAt(kImages, node)].xyz = image;
        vectors[vectorAt(kResiduals, node)].xyz = residual;
        vectors[vectorAt(kCorrections, node)].xyz = correction;
        if (kLimit) {
          vectors[vectorAt(kTotals, node)].xyz = total;
        }
      }
    }
    place += width();
  } while (place < end);
}

#endif
