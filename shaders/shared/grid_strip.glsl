// SPDX-License-Identifier: MIT
// Which nodes an invocation works on: a strip of rows of one column of one cloth.
#ifndef CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL

#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
// An invocation walks down this many rows and keeps what neighbouring rows share in registers. Loops that are
// not unrolled test at their end: on a software device a loop that tests first runs once more than it must.
layout(constant_id = 1) const uint kRowsPerInvocation = 1;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;   // TileRecord

struct Strip {
  int cloth;  // first texel of its record
  uint firstNode;
  uint rows;
  uint columns;
  uint row;  // the first of the strip; at or past `rows` for invocations that have nothing to do
  uint column;
};

Strip locateStrip(uint firstTile) {
  vec4 tile = texelFetch(tiles, int(firstTile + gl_WorkGroupID.x));
  Strip strip;
  strip.cloth = CLOTHSTREAM_CLOTH_TEXELS * int(tile.x);
  vec4 place = texelFetch(cloths, strip.cloth);
  strip.firstNode = uint(place.x) + (uint(place.y) << 16);
  strip.rows = uint(place.z);
  strip.columns = uint(place.w);
  strip.row = uint(tile.y);
  strip.column = uint(tile.z) + gl_LocalInvocationID.x;
  while (strip.column >= strip.columns) {
    strip.column -= strip.columns;
    strip.row += kRowsPerInvocation;
  }
  return strip;
}

#endif
