// SPDX-License-Identifier: MIT
// The two halves of an iteration of conjugate gradients on the assembled system. The first half multiplies
// the matrix by the residuals (SpMV, [Va21] 3.2.2) and computes the dot products. The second half takes the
// step. There is no preconditioner, as in the paper: the eigenvalues are those of the nodes' system with mass
// preconditioner (shaders/solve).
#ifndef CLOTHSTREAM_SHADERS_ASSEMBLED_MULTIPLIERS_GLSL
#define CLOTHSTREAM_SHADERS_ASSEMBLED_MULTIPLIERS_GLSL

#include "shaders/assembled/rows.glsl"
#include "shaders/shared/conjugate_gradient_step.glsl"

layout(binding = 3) uniform samplerBuffer entries;  // EntriesRecord by row
layout(binding = 4) uniform samplerBuffer columns;  // NumbersRecord
layout(binding = 5) uniform samplerBuffer values;   // multiply_jacobians.comp
// The same memory twice: a software device reads faster as texels and writes faster as storage.
layout(binding = 6, rgba32f) uniform coherent readonly imageBuffer texels;
layout(std430, binding = 7) coherent buffer Vectors {
  vec4 vectors[];
};
layout(std430, binding = 8) coherent buffer Sums {
  vec2 chunkSums[];  // by chunk: r . r, r . A r
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
RowState stateAt(uint row) {
  return rowStateFrom(fetch(kStates, row));
}
float residualAt(float column) {
  return stateAt(uint(column)).residual;
}

// Computes and stores A r of a row. Returns what the row adds to the sums.
vec2 multiplyRow(uint row) {
  EntriesRecord range = entriesAt(entries, row);
  int end = int(range.endTexel);
  precise float product = 0.0;
  for (int texel = int(range.firstTexel); texel < end; ++texel) {
    vec4 column = texelFetch(columns, texel);
    vec4 value = texelFetch(values, texel);
    product = product + value.x * residualAt(column.x);
    product = product + value.y * residualAt(column.y);
    product = product + value.z * residualAt(column.z);
    product = product + value.w * residualAt(column.w);
  }
  vectors[kProducts * push.rows + row].x = product;
  float residual = stateAt(row).residual;
  precise vec2 sums = vec2(residual * residual, residual * product);
  return sums;
}

void keepSums(System system, uint chunk) {
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    chunkSums[system.firstChunk + chunk] = sums;
  }
}

// Computes a chunk's part of A r and of the sums.
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

// Decides whether to continue, and by which step, after all `count` chunks have their sums. One workgroup
// calls this. The measured residual is that of the nodes' moves (shaders/solve), J^T r. Redundant springs
// leave a further part of r that no move makes smaller. The square of the norm of J^T r is r . J M^-1 J^T r.
void takeSums(System system, uint count, bool normOnly) {
  for (uint lane = self(); lane < kLanes; lane += width()) {
    precise vec2 sum = vec2(0.0);
    for (uint chunk = lane; chunk < count; chunk += kLanes) {
      sum = sum + chunkSums[system.firstChunk + chunk];
    }
    lanes[lane] = sum;
  }
  vec2 sums = sumOfLanes();
  if (self() == 0) {
    ClothRecord cloth = clothAt(cloths, system.cloth);
    precise float square = max(sums.y - cloth.scaledCompliance * sums.x, 0.0);
    SolveRecord solve = measured(solves[system.number], square, cloth, normOnly);
    if (solve.running != 0) {
      solve = stepped(solve, sums);
    }
    solves[system.number] = solve;
  }
}

// Takes the step in the rows of a chunk.
void updateChunk(System system, uint chunk, SolveRecord solve) {
  uint lane = self();
  do {
    [[unroll]] for (uint k = 0; k < kLaneRows; ++k) {
      uint row = rowAt(system, chunk, k, lane);
      if (row < system.endRow) {
        RowState before = stateAt(row);
        precise float direction = before.residual + solve.directionShare * before.direction;
        precise float image = fetch(kProducts, row).x + solve.directionShare * before.image;
        precise float residual = before.residual - solve.stepLength * image;
        precise float multiplier = before.multiplier + solve.stepLength * direction;
        vectors[kStates * push.rows + row] = texelFrom(RowState(residual, direction, image, multiplier));
      }
    }
    lane += width();
  } while (lane < kLanes);
}

#endif
