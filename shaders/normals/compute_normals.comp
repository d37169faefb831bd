// SPDX-License-Identifier: MIT
// Vertex normals of every grid of a scene, [Va21] 3.5, Alg. 5.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/grid_strip.glsl"

layout(binding = 2) uniform samplerBuffer positions;
layout(std430, binding = 3) writeonly buffer Normals {
  vec4 normals[];
};

vec3 fetchPosition(uint index) {
  return texelFetch(positions, int(index)).xyz;
}

// Twice the sum of the area vectors of the quadrant's triangles (p, first, diagonal) and (p, diagonal,
// second).
vec3 quadrant(vec3 p, vec3 first, vec3 diagonal, vec3 second) {
  precise vec3 across = diagonal - p;
  precise vec3 along = second - first;
  return crossProduct(across, along);
}

// Beyond an edge the window repeats the edge. Such a quadrant has no area and adds exactly zero. Writes
// cannot race: each node belongs to one invocation.
void main() {
  Strip strip = locateStrip(0);
  if (strip.row >= strip.rows) {
    return;
  }
  uint columns = strip.columns;
  uint start = strip.firstNode + strip.column;
  uint toLeft = strip.column > 0 ? 1 : 0;
  uint toRight = strip.column + 1 < columns ? 1 : 0;
  uint endRow = min(strip.row + kRowsPerInvocation, strip.rows);

  uint index = start + strip.row * columns;
  uint aboveIndex = strip.row > 0 ? index - columns : index;
  vec3 leftAbove = fetchPosition(aboveIndex - toLeft);
  vec3 above = fetchPosition(aboveIndex);
  vec3 rightAbove = fetchPosition(aboveIndex + toRight);
  vec3 left = fetchPosition(index - toLeft);
  vec3 here = fetchPosition(index);
  vec3 right = fetchPosition(index + toRight);
  uint row = strip.row;
  do {
    uint belowIndex = row + 1 < strip.rows ? index + columns : index;
    vec3 leftBelow = fetchPosition(belowIndex - toLeft);
    vec3 below = fetchPosition(belowIndex);
    vec3 rightBelow = fetchPosition(belowIndex + toRight);

    precise vec3 sum = quadrant(here, right, rightAbove, above);
    sum = sum + quadrant(here, above, leftAbove, left);
    sum = sum + quadrant(here, left, leftBelow, below);
    sum = sum + quadrant(here, below, rightBelow, right);
    precise float squared = dotProduct(sum, sum);
    precise vec3 normal = squared < 1e-30 ? vec3(0.0, 0.0, 1.0) : sum * reciprocalSquareRoot(squared);
    normals[index] = vec4(snapTiny(normal), 0.0);

    leftAbove = left;
    above = here;
    rightAbove = right;
    left = leftBelow;
    here = below;
    right = rightBelow;
    index = belowIndex;
    ++row;
  } while (row < endRow);
}
