// SPDX-License-Identifier: MIT
// The vectors of conjugate gradients, and its two halves: the matrix times the residuals with the dot
// products of that, and the step that they give. The preconditioner is a number a node.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_CONJUGATE_GRADIENT_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_CONJUGATE_GRADIENT_GLSL

#include "shaders/shared/conjugate_gradient_step.glsl"
#include "shaders/solve/linear_system.glsl"

layout(binding = 3) uniform samplerBuffer positions;   // at the substep's start; w: inverse mass
layout(binding = 4) uniform samplerBuffer incidences;  // IncidenceRecord, a node of a mesh
layout(binding = 5) uniform samplerBuffer lists;       // SpringEndsRecord
// Of a grid two texels a node, its springs to the right, below, right below, and from its right to below it;
// then to the second on the right, to the second below; what the preconditioner makes of c M. Of a mesh a
// texel a spring: prepare_springs.comp.
layout(binding = 6) uniform samplerBuffer along;
layout(binding = 7) uniform samplerBuffer across;  // the same, of an implicit grid
// Vectors lie one after the other. A software device reads texels three times as fast as storage, and writes
// storage five times as fast as texels: so one memory is bound as both.
layout(binding = 8, rgba32f) uniform coherent readonly imageBuffer texels;
layout(std430, binding = 9) coherent buffer Vectors {
  vec4 vectors[];
};
layout(std430, binding = 10) coherent buffer Sums {
  vec2 chunkSums[];  // a chunk: residual . z, z . A z,  with z the preconditioned residual
};
layout(std430, binding = 11) coherent buffer Solves {
  SolveRecord solves[];
};
layout(std430, binding = 12) readonly buffer Actives {
  uint actives[];  // a chunk: kActive, kPrepared; then those that are, a group after the other
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

struct Point {
  vec3 place;
  vec3 z;
  vec4 residual;
};

Point pointAt(uint node) {
  vec4 residual = fetch(kResiduals, node);
  precise vec3 z = residual.w * residual.xyz;
  return Point(texelFetch(positions, int(node)).xyz, z, residual);
}

// Of a spring on `here`; on `other` it is the exact negative.
vec3 pull(Point here, Point other, float along, float across) {
  precise vec3 d = other.place - here.place;
  precise vec3 relative = here.z - other.z;
  precise vec3 force = (along * dotProduct(d, relative)) * d;
  if (kImplicit) {
    force = force + across * relative;
  }
  return force;
}

// A z at a node, kept; what the node adds to the sums.
vec2 keepProduct(uint node, Point here, vec3 product) {
  precise vec3 kept = here.residual.w > 0.0 ? product : vec3(0.0);
  vectors[vectorAt(kProducts, node)].xyz = kept;
  precise vec2 sums = vec2(dotProduct(here.residual.xyz, here.z), dotProduct(here.z, kept));
  return sums;
}

struct Weights {
  vec4 near;
  vec4 far;
};

Weights weightsAt(samplerBuffer table, bool exists, uint node) {
  vec4 near = texelFetch(table, 2 * int(node));
  vec4 far = texelFetch(table, 2 * int(node) + 1);
  return Weights(exists ? near : vec4(0.0), exists ? far : vec4(0.0));
}

#define ALONG(exists, node) weightsAt(along, exists, node)
#define ACROSS(exists, node) (kImplicit ? weightsAt(across, exists, node) : Weights(vec4(0.0), vec4(0.0)))

// Down a column, with a window of registers as in shaders/mass_spring. Springs beyond an edge have no weight,
// and loads beyond it stay on it.
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
  Point leftAbove = pointAt(aboveIndex - toLeft);
  Point above = pointAt(aboveIndex);
  Point rightAbove = pointAt(aboveIndex + toRight);
  Point left = pointAt(index - toLeft);
  Point here = pointAt(index);
  Point right = pointAt(index + toRight);
  Point below = pointAt(belowIndex);
  Weights aboveAlong = ALONG(hasAbove, aboveIndex);
  Weights aboveAcross = ACROSS(hasAbove, aboveIndex);
  Weights leftAboveAlong = ALONG(hasAbove && hasLeft, aboveIndex - toLeft);
  Weights leftAboveAcross = ACROSS(hasAbove && hasLeft, aboveIndex - toLeft);
  Weights above2Along = ALONG(row > 1, above2Index);
  Weights above2Across = ACROSS(row > 1, above2Index);
  vec3 aboveForce = pull(here, above, aboveAlong.near.y, aboveAcross.near.y);
  vec3 above2Force, nextAbove2Force;
  if (kBend) {
    above2Force = pull(here, pointAt(above2Index), above2Along.far.y, above2Across.far.y);
    nextAbove2Force = pull(below, above, aboveAlong.far.y, aboveAcross.far.y);
  }

  precise vec2 sums = vec2(0.0);
  [[unroll]] for (uint k = 0; k < kWalk; ++k) {
    index = start + min(row, lastRow) * columns;
    belowIndex = start + min(row + 1, lastRow) * columns;
    Point below2 = pointAt(start + min(row + 2, lastRow) * columns);
    Point leftBelow = pointAt(belowIndex - toLeft);
    Point rightBelow = pointAt(belowIndex + toRight);
    Weights own = ALONG(true, index);
    Weights ownAcross = ACROSS(true, index);
    Weights ofLeft = ALONG(hasLeft, index - toLeft);
    Weights ofLeftAcross = ACROSS(hasLeft, index - toLeft);

    vec3 belowForce = pull(here, below, own.near.y, ownAcross.near.y);
    precise vec3 sum = own.far.z * here.residual.xyz;
    sum = sum + pull(here, left, ofLeft.near.x, ofLeftAcross.near.x);
    sum = sum + pull(here, right, own.near.x, ownAcross.near.x);
    sum = sum + aboveForce;
    sum = sum + belowForce;
    sum = sum + pull(here, leftAbove, leftAboveAlong.near.z, leftAboveAcross.near.z);
    sum = sum + pull(here, rightAbove, aboveAlong.near.w, aboveAcross.near.w);
    sum = sum + pull(here, leftBelow, ofLeft.near.w, ofLeftAcross.near.w);
    sum = sum + pull(here, rightBelow, own.near.z, ownAcross.near.z);
    if (kBend) {
      float left2Along = ALONG(hasLeft2, index - toLeft2).far.x;
      float left2Across = ACROSS(hasLeft2, index - toLeft2).far.x;
      vec3 below2Force = pull(here, below2, own.far.y, ownAcross.far.y);
      sum = sum + pull(here, pointAt(index - toLeft2), left2Along, left2Across);
      sum = sum + pull(here, pointAt(index + toRight2), own.far.x, ownAcross.far.x);
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

// Over the springs that meet at each node.
vec2 multiplyMesh(System system, Walk walk) {
  float compliance = texelFetch(cloths, system.cloth + 5).x;
  precise vec2 sums = vec2(0.0);
  for (uint k = 0; k < kWalk; ++k) {
    uint node = walk.first + min(k, max(walk.count, 1) - 1);
    Point here = pointAt(node);
    float inverseMass = texelFetch(positions, int(node)).w;
    precise vec3 sum =
        kImplicit ? reciprocal(max(inverseMass, 1e-30)) * here.z : compliance * here.residual.xyz;
    vec4 list = texelFetch(incidences, int(node));
    int texel = int(wholeNumber(list.x, list.y));
    int end = texel + int(list.z);
    while (texel < end) {
      vec4 two = texelFetch(lists, texel);
      [[unroll]] for (int i = 0; i < 4; i += 2) {
        int spring = int(system.firstSpring + uint(max(abs(two[i]), 1.0)) - 1);
        vec4 other = fetch(kResiduals, uint(two[i + 1]));
        vec4 row = texelFetch(along, spring);
        precise vec3 relative = here.z - other.w * other.xyz;
        precise vec3 part = dotProduct(row.xyz, relative) * row.xyz;
        if (kImplicit) {
          part = part + row.w * relative;
        }
        sum = sum + (two[i] == 0.0 ? vec3(0.0) : part);
      }
      ++texel;
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

void keepSums(System system, uint chunk) {
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    chunkSums[system.firstChunk + chunk] = sums;
  }
}

// A chunk's part of A z, and of the sums.
void multiplyChunk(System system, uint chunk) {
  uint end = lanesOf(system, chunk);
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    vec2 sums = vec2(0.0);
    if (walk.count > 0 && lane < end) {
      sums = kMesh ? multiplyMesh(system, walk) : multiplyGrid(system, walk);
    }
    lanes[lane] = sums;
    lane += width();
  } while (lane < end);
  keepSums(system, chunk);
}

// The residual's norm alone.
void measureChunk(System system, uint chunk) {
  uint end = lanesOf(system, chunk);
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    precise vec2 sums = vec2(0.0);
    [[unroll]] for (uint k = 0; k < kWalk; ++k) {
      if (k < walk.count && lane < end) {
        vec4 residual = fetch(kResiduals, walk.first + k * walk.step);
        precise vec3 z = residual.w * residual.xyz;
        sums.x = sums.x + dotProduct(residual.xyz, z);
      }
    }
    lanes[lane] = sums;
    lane += width();
  } while (lane < end);
  keepSums(system, chunk);
}

// The chunk that a workgroup has where several solve a system.
vec4 ownChunk() {
  return texelFetch(chunks, int(actives[actives.length() / 2 + push.firstChunk + gl_WorkGroupID.x]));
}

// Once all chunks have their sums: whether to go on, and how far. By one workgroup.
void takeSums(System system, bool norm) {
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
  vec4 solver = texelFetch(cloths, system.cloth + 5);
  SolveRecord solve = measured(solves[system.number], sums.x, solver, norm);
  if (solve.running != 0) {
    solve = stepped(solve, sums);
  }
  solves[system.number] = solve;
}

// What a chunk's nodes gain by the step.
void updateChunk(System system, uint chunk, SolveRecord solve) {
  uint end = solve.running == 0 ? 0 : lanesOf(system, chunk);
  bool first = solve.iterations == 1;
  uint lane = self();
  do {
    Walk walk = walkAt(system, chunk * kLanes + lane);
    [[unroll]] for (uint k = 0; k < kWalk; ++k) {
      uint node = walk.first + min(k, max(walk.count, 1) - 1) * walk.step;
      vec4 before = fetch(kResiduals, node);
      vec3 oldDirection = first ? vec3(0.0) : fetch(kDirections, node).xyz;
      vec3 oldImage = first ? vec3(0.0) : fetch(kImages, node).xyz;
      precise vec3 direction = before.w * before.xyz + solve.turn * oldDirection;
      precise vec3 image = fetch(kProducts, node).xyz + solve.turn * oldImage;
      precise vec3 residual = before.xyz - solve.stepLength * image;
      precise vec3 correction = fetch(kCorrections, node).xyz + solve.stepLength * direction;
      if (k < walk.count && lane < end) {
        vectors[vectorAt(kDirections, node)].xyz = direction;
        vectors[vectorAt(kImages, node)].xyz = image;
        vectors[vectorAt(kResiduals, node)].xyz = residual;
        vectors[vectorAt(kCorrections, node)].xyz = correction;
      }
    }
    lane += width();
  } while (lane < end);
}

#endif
