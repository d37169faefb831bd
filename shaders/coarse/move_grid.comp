// SPDX-License-Identifier: MIT
// Moves the nodes of a grid by the corrections of the four coarse nodes around each: bilinear interpolation.
// Each invocation walks down a column.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/coarse/coarse.h"
#include "shaders/coarse/move.glsl"

layout(local_size_x_id = 0) in;
// Rows that an invocation moves of a column.
layout(constant_id = 2) const uint kRows = 8;

// Way of the invocation's column at a coarse row.
vec3 wayAt(uint coarseRow, uint coarseColumn, float part) {
  int coarse = int(coarseRow * push.coarseColumns + coarseColumn);
  precise vec3 way = (1.0 - part) * correctionAt(coarse) + part * correctionAt(coarse + 1);
  return way;
}

// The last cell of a row or column may be shorter than the others.
float inverseLength(uint cell, uint coarseCount, float inverseLast) {
  return cell + 2 == coarseCount ? inverseLast : push.inverseStride;
}

// Writes cannot race: each node belongs to one invocation.
void main() {
  uint invocation = gl_GlobalInvocationID.x;
  uint strip = invocation / push.columns;
  uint column = invocation - strip * push.columns;
  uint row = strip * kRows;
  uint end = min(row + kRows, push.rows);
  if (row >= end) {
    return;
  }
  uint across = min(column / push.stride, push.coarseColumns - 2);
  precise float part = float(column - across * push.stride) *
                       inverseLength(across, push.coarseColumns, push.inverseLastColumns);
  uint cell = min(row / push.stride, push.coarseRows - 2);
  vec3 before = wayAt(cell, across, part);
  vec3 after = wayAt(cell + 1, across, part);
  for (; row < end; ++row) {
    if (row == (cell + 1) * push.stride && cell + 2 < push.coarseRows) {
      ++cell;
      before = after;
      after = wayAt(cell + 1, across, part);
    }
    precise float down =
        float(row - cell * push.stride) * inverseLength(cell, push.coarseRows, push.inverseLastRows);
    precise vec3 way = (1.0 - down) * before + down * after;
    moveNode(push.firstNode + row * push.columns + column, way);
  }
}
