// SPDX-License-Identifier: MIT
// Which nodes an invocation works on: a strip of rows of one column of one cloth.
#ifndef CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_GRID_STRIP_GLSL

#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
// An invocation walks down this many rows and keeps what neighbouring rows share in registers.
layout(constant_id = 1) const uint kRowsPerInvocation = 1;

layout(std430, binding = 0) readonly buffer Cloths { ClothRecord cloths[]; };
layout(std430, binding = 1) readonly buffer Tiles { TileRecord tiles[]; };

struct Strip {
  uint cloth;
  uint row;  // the first; at or past the cloth's last for invocations that have nothing to do
  uint column;
};

Strip locateStrip() {
  TileRecord tile = tiles[gl_WorkGroupID.x];
  uint columns = cloths[tile.cloth].columns;
  Strip strip = Strip(tile.cloth, tile.row, tile.column + gl_LocalInvocationID.x);
  while (strip.column >= columns) {
    strip.column -= columns;
    strip.row += kRowsPerInvocation;
  }
  return strip;
}

#endif
