// SPDX-License-Identifier: MIT
// (J M^-1 J^T + compliance / h^2) lambda = right-hand side by conjugate gradients, [Va21] Eq. 12-17,
// matrix-free: J is applied as two gathers. One workgroup solves one cloth, as many iterations in a dispatch
// as the device lets it.
//
// The bits do not depend on the workgroup's size: dot products are fixed sums, everything else is done an
// element at a time.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/constraint/incidence.glsl"
#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"

// Whether some of the constraints are not active: rows of zeros. The others are listed then.
layout(constant_id = 1) const bool kAdaptive = false;

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
layout(std430, binding = 12) buffer Actives {
  uint actives[];
};
layout(std430, binding = 13) buffer Solves {
  SolveRecord solves[];
};

layout(push_constant) uniform Push {
  SolvePush push;
};

// Where fewer than one in so many constraints is active, their nodes' sums are made for each of them anew.
const uint kSparse = 4;

shared uint counts[kLanes];

// Lists those rows that are not zero, in their order; returns how many.
uint listActives(uint firstLink, uint linkCount) {
  uint chunk = (linkCount + kLanes - 1) / kLanes;
  for (uint lane = self(); lane < kLanes; lane += width()) {
    uint count = 0;
    for (uint i = lane * chunk; i < min(lane * chunk + chunk, linkCount); ++i) {
      count += texelFetch(rows, int(firstLink + i)).xyz == vec3(0.0) ? 0 : 1;
    }
    counts[lane] = count;
  }
  barrier();
  if (self() == 0) {
    uint before = 0;
    for (uint lane = 0; lane < kLanes; ++lane) {
      uint count = counts[lane];
      counts[lane] = before;
      before += count;
    }
    solves[gl_WorkGroupID.x + push.firstSystem].constraints = before;
  }
  memoryBarrierBuffer();
  barrier();
  for (uint lane = self(); lane < kLanes; lane += width()) {
    uint place = firstLink + counts[lane];
    for (uint i = lane * chunk; i < min(lane * chunk + chunk, linkCount); ++i) {
      if (texelFetch(rows, int(firstLink + i)).xyz != vec3(0.0)) {
        actives[place] = firstLink + i;
        ++place;
      }
    }
  }
  memoryBarrierBuffer();
  barrier();
  return solves[gl_WorkGroupID.x + push.firstSystem].constraints;
}

uint linkAt(uint firstLink, uint i) {
  return kAdaptive ? actives[firstLink + i] : firstLink + i;
}

#define DIRECTION(link) directions[link]

// M^-1 J^T direction.
vec3 moveOf(int node, uint firstLink) {
  float inverseMass = texelFetch(positions, node).w;
  if (inverseMass == 0.0) {
    return vec3(0.0);
  }
  vec4 incidence = texelFetch(incidences, node);
  vec3 force;
  GATHER(force, incidence, firstLink, DIRECTION)
  precise vec3 move = inverseMass * force;
  return move;
}

void main() {
  uint system = gl_WorkGroupID.x + push.firstSystem;
  vec4 place = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(system));
  vec4 nodePlace = texelFetch(systems, CLOTHSTREAM_SYSTEM_TEXELS * int(system) + 1);
  uint firstLink = wholeNumber(place.x, place.y);
  uint linkCount = uint(place.z);
  uint firstNode = uint(nodePlace.x);
  uint nodeCount = uint(nodePlace.y);
  vec4 solver = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(place.w) + 5);
  float compliance = solver.x;
  uint iterations = min(uint(solver.y), push.endIteration);

  uint count = linkCount;
  float start, square;
  uint done = 0;
  if (push.firstIteration == 0) {
    if (kAdaptive) {
      count = listActives(firstLink, linkCount);
    }
    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < count; i += kLanes) {
        float residual = residuals[linkAt(firstLink, i)];
        sum = sum + residual * residual;
      }
      lanes[lane] = sum;
    }
    start = sumOfLanes();
    square = start;
  } else {
    SolveRecord solve = solves[system];
    count = solve.constraints;
    start = solve.start;
    square = solve.square;
    done = solve.iterations;
  }
  bool sparse = kAdaptive && count * kSparse < linkCount;
  precise float enough = max(start * solver.z, 1e-30);

  while (done < iterations && square > enough) {
    if (!sparse) {
      for (uint i = self(); i < nodeCount; i += width()) {
        moves[firstNode + i].xyz = moveOf(int(firstNode + i), firstLink);
      }
      memoryBarrierBuffer();
      barrier();
    }

    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < count; i += kLanes) {
        uint link = linkAt(firstLink, i);
        vec4 ends = texelFetch(links, int(link));
        float along = directions[link];
        vec3 moveA, moveB;
        if (sparse) {
          moveA = moveOf(int(ends.x), firstLink);
          moveB = moveOf(int(ends.y), firstLink);
        } else {
          moveA = moves[int(ends.x)].xyz;
          moveB = moves[int(ends.y)].xyz;
        }
        precise vec3 relative = moveB - moveA;
        precise float product = dotProduct(texelFetch(rows, int(link)).xyz, relative) + compliance * along;
        products[link] = product;
        sum = sum + along * product;
      }
      lanes[lane] = sum;
    }
    precise float curvature = max(sumOfLanes(), 1e-30);
    precise float stepLength = square * reciprocal(curvature);

    for (uint lane = self(); lane < kLanes; lane += width()) {
      precise float sum = 0.0;
      for (uint i = lane; i < count; i += kLanes) {
        uint link = linkAt(firstLink, i);
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
    for (uint i = self(); i < count; i += width()) {
      uint link = linkAt(firstLink, i);
      precise float direction = residuals[link] + turn * directions[link];
      directions[link] = direction;
    }
    memoryBarrierBuffer();
    barrier();
    ++done;
  }
  if (self() == 0) {
    solves[system] = SolveRecord(done, relativeNorm(square, start), start, square, count);
  }
}
