// SPDX-License-Identifier: MIT
// Finds the chunks of ACAD's grids with a spring that the forces alone would stretch too far, [Va21] 3.3. The
// solve skips the other chunks. A workgroup handles one chunk.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "shaders/solve/spring_terms.glsl"

// True if the spring between `here` and `there` becomes a constraint. `longest` below 0 means no spring.
bool isStretched(vec4 here, vec4 there, float longest) {
  precise float inverseMasses = here.w + there.w;
  return longest >= 0.0 && inverseMasses > 0.0 && isTooLong(here.xyz, there.xyz, longest);
}

// Walks down a column with a window of registers, as in conjugate_gradient.glsl. Both nodes of a spring check
// it, because they may lie in different chunks.
bool isAnyStretched(System system, Walk walk, ClothRecord cloth) {
  vec3 spacing = vec3(cloth.columnSpacing, cloth.rowSpacing, cloth.diagonalSpacing);
  bool hasBend = cloth.solvesBend != 0.0;
  uint columns = system.columns;
  uint lastRow = system.rows - 1;
  uint toLeft = walk.column > 0 ? 1 : 0;
  uint toRight = walk.column + 1 < columns ? 1 : 0;
  uint toLeft2 = walk.column > 1 ? 2 : 0;
  uint toRight2 = walk.column + 2 < columns ? 2 : 0;
  precise vec3 longest = spacing + cloth.activation * spacing;
  precise vec2 bend = hasBend ? 2.0 * spacing.xy + cloth.activation * (2.0 * spacing.xy) : vec2(1e18);
  float left2Longest = toLeft2 > 0 ? bend.x : -1.0;
  float right2Longest = toRight2 > 0 ? bend.x : -1.0;
  float leftLongest = toLeft > 0 ? longest.x : -1.0;
  float rightLongest = toRight > 0 ? longest.x : -1.0;
  float leftShear = toLeft > 0 ? longest.z : -1.0;
  float rightShear = toRight > 0 ? longest.z : -1.0;
  uint start = system.firstNode + walk.column;
  uint row = walk.row;
  uint aboveIndex = start + (row > 0 ? row - 1 : 0) * columns;
  uint index = start + row * columns;
  vec4 above2 = texelFetch(freePositions, int(start + (row > 1 ? row - 2 : 0) * columns));
  vec4 leftAbove = texelFetch(freePositions, int(aboveIndex - toLeft));
  vec4 above = texelFetch(freePositions, int(aboveIndex));
  vec4 rightAbove = texelFetch(freePositions, int(aboveIndex + toRight));
  vec4 left = texelFetch(freePositions, int(index - toLeft));
  vec4 here = texelFetch(freePositions, int(index));
  vec4 right = texelFetch(freePositions, int(index + toRight));
  vec4 below = texelFetch(freePositions, int(start + min(row + 1, lastRow) * columns));
  bool any = isStretched(here, above, row > 0 ? longest.y : -1.0);
  bool anyAbove2 = isStretched(here, above2, row > 1 ? bend.y : -1.0);
  bool anyNextAbove2 = isStretched(below, above, row > 0 && row < lastRow ? bend.y : -1.0);
  [[unroll]] for (uint k = 0; k < kWalk; ++k) {
    uint belowIndex = start + min(row + 1, lastRow) * columns;
    bool hasBelow = row < lastRow;
    index = start + min(row, lastRow) * columns;
    vec4 leftBelow = texelFetch(freePositions, int(belowIndex - toLeft));
    vec4 rightBelow = texelFetch(freePositions, int(belowIndex + toRight));
    vec4 below2 = texelFetch(freePositions, int(start + min(row + 2, lastRow) * columns));
    bool anyBelow = isStretched(here, below, hasBelow ? longest.y : -1.0);
    any = any || anyBelow;
    any = any || isStretched(here, left, leftLongest);
    any = any || isStretched(here, right, rightLongest);
    any = any || isStretched(here, leftAbove, row > 0 ? leftShear : -1.0);
    any = any || isStretched(here, rightAbove, row > 0 ? rightShear : -1.0);
    any = any || isStretched(here, leftBelow, hasBelow ? leftShear : -1.0);
    any = any || isStretched(here, rightBelow, hasBelow ? rightShear : -1.0);
    if (kBend) {
      bool anyBelow2 = isStretched(here, below2, row + 1 < lastRow ? bend.y : -1.0);
      any = any || anyAbove2 || anyBelow2;
      any = any || isStretched(here, texelFetch(freePositions, int(index - toLeft2)), left2Longest);
      any = any || isStretched(here, texelFetch(freePositions, int(index + toRight2)), right2Longest);
      anyAbove2 = anyNextAbove2;
      anyNextAbove2 = anyBelow2;
    }
    leftAbove = left;
    rightAbove = right;
    left = leftBelow;
    right = rightBelow;
    here = below;
    below = below2;
    ++row;
  }
  return any;
}

void main() {
  ChunkRecord part = chunkAt(chunks, push.firstChunk + gl_WorkGroupID.x);
  System system = systemAt(uint(part.system));
  ClothRecord cloth = clothAt(cloths, system.cloth);
  beginChunk();
  uint lane = self();
  bool any = false;
  do {
    Walk walk = walkAt(system, uint(part.chunk) * kLanes + lane);
    any = isAnyStretched(system, walk, cloth) && walk.count > 0 || any;
    lane += width();
  } while (lane < kLanes);
  if (any) {
    atomicOr(touched, 1);
  }
  keepActive(system, uint(part.chunk));
}
