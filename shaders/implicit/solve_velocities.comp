// SPDX-License-Identifier: MIT
// (M + h D + h^2 K) (v' - v) = M (v_free - v) - h^2 K v:  implicit Euler's velocities v' from those at the
// substep's start and those that the forces alone give (Baraff and Witkin, "Large steps in cloth simulation",
// 1998). From v' = v on, so that a solve that ends early leaves motion out rather than forces unbraked.
// Conjugate gradients with the diagonal as preconditioner, matrix-free: a product is one gather. One
// workgroup solves one cloth, as many iterations in a dispatch as the device lets it.
//
// The bits do not depend on the workgroup's size: dot products are fixed sums, everything else is done a node
// at a time. Pinned nodes have neither residual nor direction.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/implicit/incidence.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"

layout(binding = 5) uniform samplerBuffer impulses;
layout(binding = 6) uniform samplerBuffer positions;   // w: inverse mass
layout(binding = 7) uniform samplerBuffer velocities;  // at the substep's start
layout(binding = 8) uniform samplerBuffer freeVelocities;
layout(std430, binding = 9) buffer Corrections {
  vec4 corrections[];  // of the free velocities
};
layout(std430, binding = 10) buffer Residuals {
  vec4 residuals[];  // w: one over the matrix's diagonal, 0 for pinned nodes
};
layout(std430, binding = 11) buffer Directions {
  vec4 directions[];
};
layout(std430, binding = 12) buffer Products {
  vec4 products[];
};
layout(std430, binding = 13) buffer Solves {
  SolveRecord solves[];
};

layout(push_constant) uniform Push {
  SolvePush push;
};

// The right-hand side, and the diagonal: a third of the trace of a node's block.
void begin(uint node, uint firstSpring) {
  float inverseMass = texelFetch(positions, int(node)).w;
  precise vec3 gained = texelFetch(freeVelocities, int(node)).xyz - texelFetch(velocities, int(node)).xyz;
  precise vec3 residual = vec3(0.0);
  float inverseDiagonal = 0.0;
  if (inverseMass > 0.0) {
    residual = reciprocal(inverseMass) * gained;
    precise float trace = 0.0;
    SpringList list = springsOf(node);
    while (list.first < list.end) {
      vec4 two = texelFetch(lists, list.first);
      for (int k = 0; k < 4; k += 2) {
        int spring = springOf(two[k], firstSpring);
        vec4 row = texelFetch(rows, spring);
        float sign_ = signOf(two[k]);
        residual = residual + sign_ * texelFetch(impulses, spring).xyz;
        trace = trace + abs(sign_) * (dotProduct(row.xyz, row.xyz) + 3.0 * row.w);
      }
      ++list.first;
    }
    precise float diagonal = reciprocal(inverseMass) + trace * 0.33333334;
    inverseDiagonal = reciprocal(diagonal);
  }
  precise vec3 direction = inverseDiagonal * residual;
  corrections[node] = vec4(-gained, 0.0);
  residuals[node] = vec4(residual, inverseDiagonal);
  directions[node] = vec4(direction, 0.0);
}

// (M + h D + h^2 K) direction.
vec3 productAt(uint node, uint firstSpring) {
  float inverseMass = texelFetch(positions, int(node)).w;
  if (inverseMass == 0.0) {
    return vec3(0.0);
  }
  vec3 own = directions[node].xyz;
  precise vec3 sum = reciprocal(inverseMass) * own;
  SpringList list = springsOf(node);
  while (list.first < list.end) {
    vec4 two = texelFetch(lists, list.first);
    for (int k = 0; k < 4; k += 2) {
      vec4 row = texelFetch(rows, springOf(two[k], firstSpring));
      precise vec3 relative = own - directions[uint(two[k + 1])].xyz;
      precise vec3 part = dotProduct(row.xyz, relative) * row.xyz + row.w * relative;
      sum = sum + abs(signOf(two[k])) * part;
    }
    ++list.first;
  }
  return sum;
}

void main() {
  uint system = gl_WorkGroupID.x + push.firstSystem;
  vec4 place = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(system));
  vec4 nodePlace = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(system) + 1);
  uint firstSpring = wholeNumber(place.x, place.y);
  uint firstNode = uint(nodePlace.x);
  uint nodeCount = uint(nodePlace.y);
  vec4 solver = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(place.w) + 5);
  uint iterations = min(uint(solver.y), push.endIteration);

  float start, square;
  uint done = 0;
  if (push.firstIteration == 0) {
    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < nodeCount; i += kLanes) {
        uint node = firstNode + i;
        begin(node, firstSpring);
        sum = sum + dotProduct(residuals[node].xyz, directions[node].xyz);
      }
      lanes[lane] = sum;
    }
    memoryBarrierBuffer();
    start = sumOfLanes();
    square = start;
  } else {
    SolveRecord solve = solves[system];
    start = solve.start;
    square = solve.square;
    done = solve.iterations;
  }
  precise float enough = max(start * solver.z, 1e-30);

  while (done < iterations && square > enough) {
    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < nodeCount; i += kLanes) {
        uint node = firstNode + i;
        vec3 product = productAt(node, firstSpring);
        products[node].xyz = product;
        sum = sum + dotProduct(directions[node].xyz, product);
      }
      lanes[lane] = sum;
    }
    precise float curvature = max(sumOfLanes(), 1e-30);
    precise float stepLength = square * reciprocal(curvature);

    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < nodeCount; i += kLanes) {
        uint node = firstNode + i;
        vec4 before = residuals[node];
        precise vec3 correction = corrections[node].xyz + stepLength * directions[node].xyz;
        precise vec3 residual = before.xyz - stepLength * products[node].xyz;
        corrections[node].xyz = correction;
        residuals[node].xyz = residual;
        sum = sum + before.w * dotProduct(residual, residual);
      }
      lanes[lane] = sum;
    }
    float before = square;
    square = sumOfLanes();
    precise float turn = square * reciprocal(before);
    for (uint i = self(); i < nodeCount; i += width()) {
      uint node = firstNode + i;
      vec4 residual = residuals[node];
      precise vec3 direction = residual.w * residual.xyz + turn * directions[node].xyz;
      directions[node].xyz = direction;
    }
    memoryBarrierBuffer();
    barrier();
    ++done;
  }
  if (self() == 0) {
    solves[system] = SolveRecord(done, relativeNorm(square, start), start, square, 0);
  }
}
