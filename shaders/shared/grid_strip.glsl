// SPDX-License-Identifier: MIT
// The nodes that an invocation works on: a strip of rows of one column of one grid.
#ifndef CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL

#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
// Rows that an invocation walks down. Values that neighbouring rows share stay in registers. Loops that are
// not unrolled test at their end: on a software device, a loop that tests first runs once more than needed.
layout(constant_id = 1) const uint kRowsPerInvocation = 1;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;   // TileRecord

struct Strip {
  uint cloth;
  uint firstNode;
  uint rows;
  uint columns;
  uint row;  // first row of the strip; at or past `rows` if the invocation has nothing to do
  uint column;
};

Strip locateStrip(uint firstTile) {
  TileRecord tile = tileAt(tiles, firstTile + gl_WorkGroupID.x);
  Strip strip;
  strip.cloth = uint(tile.cloth);
  ClothRecord cloth = clothAt(cloths, strip.cloth);
  strip.firstNode = firstNodeOf(cloth);
  strip.rows = uint(cloth.rows);
  strip.columns = uint(cloth.columns);
  strip.row = uint(tile.row);
  strip.column = uint(tile.column) + gl_LocalInvocationID.x;
  while (strip.column >= strip.columns) {
    strip.column -= strip.columns;
    strip.row += kRowsPerInvocation;
  }
  return strip;
}

#endif
