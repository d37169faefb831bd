// SPDX-License-Identifier: MIT
// (J M^-1 J^T + compliance / h^2) lambda = right-hand side by conjugate gradients, [Va21] Eq. 12-17,
// matrix-free: J is applied as two gathers. One workgroup solves one cloth, as many
// iterations in a dispatch as the device lets it.
//
// Dot products add up in kLanes fixed lanes and then a fixed tree, so that their bits do not depend on the
// workgroup's size; everything else is done an element at a time.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/constraint/incidence.glsl"
#include "shaders/shared/arithmetic.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 5) uniform samplerBuffer links;      // LinkRecord
layout(binding = 6) uniform samplerBuffer positions;  // w: inverse mass
layout(std430, binding = 7) buffer Multipliers {
  float multipliers[];
};
layout(std430, binding = 8) buffer Residuals {
  float residuals[];
};
layout(std430, binding = 9) buffer Directions {
  float directions[];
};
layout(std430, binding = 10) buffer Products {
  float products[];
};
layout(std430, binding = 11) buffer Moves {
  vec4 moves[];  // M^-1 J^T direction, a node
};
layout(std430, binding = 12) buffer Solves {
  SolveRecord solves[];
};

layout(push_constant) uniform Push {
  SolvePush push;
};

const uint kLanes = CLOTHSTREAM_SOLVE_LANES;
shared float lanes[kLanes];

// Of the lanes, written by whoever; every invocation gets it.
float sumOfLanes() {
  barrier();
  for (uint width = kLanes / 2; width > 0; width /= 2) {
    for (uint lane = gl_LocalInvocationID.x; lane < width; lane += gl_WorkGroupSize.x) {
      precise float sum = lanes[lane] + lanes[lane + width];
      lanes[lane] = sum;
    }
    barrier();
  }
  float sum = lanes[0];
  barrier();
  return sum;
}

#define DIRECTION(link) directions[link]

// lambda = 0, and direction and residual the right-hand side. Returns the square of its norm.
float begin(uint firstLink, uint linkCount) {
  for (uint lane = gl_LocalInvocationID.x; lane < kLanes; lane += gl_WorkGroupSize.x) {
    precise float sum = 0.0;
    for (uint i = lane; i < linkCount; i += kLanes) {
      uint link = firstLink + i;
      float side = texelFetch(rows, int(link)).w;
      multipliers[link] = 0.0;
      residuals[link] = side;
      directions[link] = side;
      sum = sum + side * side;
    }
    lanes[lane] = sum;
  }
  memoryBarrierBuffer();
  return sumOfLanes();
}

void main() {
  vec4 place = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(gl_WorkGroupID.x));
  vec4 nodePlace = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(gl_WorkGroupID.x) + 1);
  uint firstLink = wholeNumber(place.x, place.y);
  uint linkCount = uint(place.z);
  uint firstNode = uint(nodePlace.x);
  uint nodeCount = uint(nodePlace.y);
  vec4 solver = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(place.w) + 5);
  float compliance = solver.x;
  uint iterations = uint(solver.y);
  uint self = gl_LocalInvocationID.x;
  uint width = gl_WorkGroupSize.x;

  SolveRecord solve = solves[gl_WorkGroupID.x];
  if (push.firstIteration == 0) {
    solve.iterations = 0;
    solve.start = begin(firstLink, linkCount);
    solve.square = solve.start;
  }
  precise float enough = max(solve.start * solver.z, 1e-30);
  float square = solve.square;
  uint done = solve.iterations;
  iterations = min(iterations, push.endIteration);
  while (done < iterations && square > enough) {
    for (uint i = self; i < nodeCount; i += width) {
      uint node = firstNode + i;
      float inverseMass = texelFetch(positions, int(node)).w;
      vec4 incidence = texelFetch(incidences, int(node));
      vec3 force = vec3(0.0);
      if (inverseMass > 0.0) {
        GATHER(force, incidence, firstLink, DIRECTION)
      }
      precise vec3 move = inverseMass * force;
      moves[node].xyz = move;
    }
    memoryBarrierBuffer();
    barrier();

    for (uint lane = self; lane < kLanes; lane += width) {
      precise float sum = 0.0;
      for (uint i = lane; i < linkCount; i += kLanes) {
        uint link = firstLink + i;
        vec4 ends = texelFetch(links, int(link));
        float along = directions[link];
        precise vec3 relative = moves[int(ends.y)].xyz - moves[int(ends.x)].xyz;
        precise float product = dotProduct(texelFetch(rows, int(link)).xyz, relative) + compliance * along;
        products[link] = product;
        sum = sum + along * product;
      }
      lanes[lane] = sum;
    }
    precise float curvature = max(sumOfLanes(), 1e-30);
    precise float stepLength = square * reciprocal(curvature);

    for (uint lane = self; lane < kLanes; lane += width) {
      precise float sum = 0.0;
      for (uint i = lane; i < linkCount; i += kLanes) {
        uint link = firstLink + i;
        precise float multiplier = multipliers[link] + stepLength * directions[link];
        precise float residual = residuals[link] - stepLength * products[link];
        multipliers[link] = multiplier;
        residuals[link] = residual;
        sum = sum + residual * residual;
      }
      lanes[lane] = sum;
    }
    float before = square;
    square = sumOfLanes();
    precise float turn = square * reciprocal(before);
    for (uint i = self; i < linkCount; i += width) {
      uint link = firstLink + i;
      precise float direction = residuals[link] + turn * directions[link];
      directions[link] = direction;
    }
    memoryBarrierBuffer();
    barrier();
    ++done;
  }
  if (self == 0) {
    precise float ratio = square * reciprocal(max(solve.start, 1e-30));
    float left = ratio > 1e-30 ? ratio * reciprocalSquareRoot(ratio) : 0.0;
    solves[gl_WorkGroupID.x] = SolveRecord(done, left, solve.start, square);
  }
}
