// SPDX-License-Identifier: MIT
// The cell of a position, and its entry in the table.
#ifndef CLOTHSTREAM_SHADERS_SELF_COLLISION_CELLS_GLSL
#define CLOTHSTREAM_SHADERS_SELF_COLLISION_CELLS_GLSL

#include "shaders/self_collision/self_collision.h"

// Positions far out, and components that are not numbers, fall into cell 0.
int cellAlong(float place, float inverseWidth) {
  precise float scaled = place * inverseWidth;
  return scaled > -8388608.0 && scaled < 8388608.0 ? int(floor(scaled)) : 0;
}

ivec3 cellOf(vec3 place, float inverseWidth) {
  return ivec3(cellAlong(place.x, inverseWidth), cellAlong(place.y, inverseWidth),
               cellAlong(place.z, inverseWidth));
}

uint entryOf(ivec3 cell, uint cellCount) {
  return ((uint(cell.y) * 73856093u ^ uint(cell.z) * 19349663u) + uint(cell.x)) & (cellCount - 1);
}

#endif
