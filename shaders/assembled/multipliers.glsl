// SPDX-License-Identifier: MIT
// The two halves of conjugate gradients on the assembled system: the matrix times the residuals (SpMV, [Va21]
// 3.2.2) with the dot products of that, and the step that they give. Without preconditioner, as in the paper:
// the eigenvalues are those of the nodes' system with their masses as one (shaders/solve).
#ifndef CLOTHSTREAM_SHADERS_ASSEMBLED_MULTIPLIERS_GLSL
#define CLOTHSTREAM_SHADERS_ASSEMBLED_MULTIPLIERS_GLSL

#include "shaders/assembled/rows.glsl"
#include "shaders/shared/conjugate_gradient_step.glsl"

layout(binding = 3) uniform samplerBuffer entries;  // EntriesRecord, a row
layout(binding = 4) uniform samplerBuffer columns;  // NumbersRecord
layout(binding = 5) uniform samplerBuffer values;   // multiply_jacobians.comp
// One memory, which a software device reads faster as texels and writes faster as storage.
layout(binding = 6, rgba32f) uniform coherent readonly imageBuffer texels;
layout(std430, binding = 7) coherent buffer Vectors {
  vec4 vectors[];
};
layout(std430, binding = 8) coherent buffer Sums {
  vec2 chunkSums[];  // a chunk: r . r, r . A r
};
layout(std430, binding = 9) coherent buffer Solves {
  SolveRecord solves[];
};

layout(push_constant) uniform Push {
  MultiplierPush push;
};

vec4 fetch(uint which, uint row) {
  return imageLoad(texels, int(which * push.rows + row));
}
float residualAt(float column) {
  return fetch(kStates, uint(column)).x;
}

// A r of a row, kept; what the row adds to the sums.
vec2 multiplyRow(uint row) {
  vec4 range = texelFetch(entries, int(row));
  int end = int(range.y);
  precise float product = 0.0;
  for (int texel = int(range.x); texel < end; ++texel) {
    vec4 column = texelFetch(columns, texel);
    vec4 value = texelFetch(values, texel);
    product = product + value.x * residualAt(column.x);
    product = product + value.y * residualAt(column.y);
    product = product + value.z * residualAt(column.z);
    product = product + value.w * residualAt(column.w);
  }
  vectors[kProducts * push.rows + row].x = product;
  float residual = fetch(kStates, row).x;
  precise vec2 sums = vec2(residual * residual, residual * product);
  return sums;
}

void keepSums(System system, uint chunk) {
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    chunkSums[system.firstChunk + chunk] = sums;
  }
}

// A chunk's part of A r, and of the sums.
void multiplyChunk(System system, uint chunk) {
  uint lane = self();
  do {
    precise vec2 sums = vec2(0.0);
    uint k = 0;
    do {
      uint row = rowAt(system, chunk, k, lane);
      if (row < system.endRow) {
        sums = sums + multiplyRow(row);
      }
      ++k;
    } while (k < kLaneRows);
    lanes[lane] = sums;
    lane += width();
  } while (lane < kLanes);
  keepSums(system, chunk);
}

// Once all `count` chunks have their sums: whether to go on, and how far. By one workgroup. The residual is
// that of the nodes' moves (shaders/solve), J^T r: what is left of r beside that, as there is where springs
// are redundant, no move would make smaller. The square of its norm is r . J M^-1 J^T r.
void takeSums(System system, uint count, bool norm) {
  for (uint lane = self(); lane < kLanes; lane += width()) {
    precise vec2 sum = vec2(0.0);
    for (uint chunk = lane; chunk < count; chunk += kLanes) {
      sum = sum + chunkSums[system.firstChunk + chunk];
    }
    lanes[lane] = sum;
  }
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    vec4 solver = texelFetch(cloths, system.cloth + 5);
    precise float square = max(sums.y - solver.x * sums.x, 0.0);
    SolveRecord solve = measured(solves[system.number], square, solver, norm);
    if (solve.running != 0) {
      solve = stepped(solve, sums);
    }
    solves[system.number] = solve;
  }
}

// What a chunk's rows gain by the step.
void updateChunk(System system, uint chunk, SolveRecord solve) {
  uint lane = self();
  do {
    [[unroll]] for (uint k = 0; k < kLaneRows; ++k) {
      uint row = rowAt(system, chunk, k, lane);
      if (row < system.endRow) {
        vec4 before = fetch(kStates, row);
        precise float direction = before.x + solve.turn * before.y;
        precise float image = fetch(kProducts, row).x + solve.turn * before.z;
        precise float residual = before.x - solve.stepLength * image;
        precise float multiplier = before.w + solve.stepLength * direction;
        vectors[kStates * push.rows + row] = vec4(residual, direction, image, multiplier);
      }
    }
    lane += width();
  } while (lane < kLanes);
}

#endif
