// SPDX-License-Identifier: MIT
// A cloth's linear system and how it is cut: what the kernels of a solve share.
//
// Unknown is what the velocities u of the nodes change by. Of a spring with d from one end to the other,
//   (c M + sum of along d d^T + across I) u = side,
// where c and each spring's `along` and `across` follow from the solver: prepare_grids.comp.
//
// Nodes are cut into walks of kWalk (rows of a column, or numbers in a row), and those into chunks of kLanes
// walks. Dot products add up along the walk, then the lanes of a chunk in a tree, then the chunks in lanes
// and a tree: nothing of that depends on the device, on the workgroup's size, or on who does which chunk.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_LINEAR_SYSTEM_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_LINEAR_SYSTEM_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"
#include "shaders/shared/simulation.h"
#include "shaders/shared/whole_number.glsl"

// Whether springs pull as they will (implicit Euler) or hold their length.
layout(constant_id = 1) const bool kImplicit = false;
layout(constant_id = 2) const bool kMesh = false;
// Whether bend springs of any grid are solved for.
layout(constant_id = 3) const bool kBend = true;
// Whether springs are constraints only where they would be stretched too far.
layout(constant_id = 4) const bool kAdaptive = false;

layout(binding = 0) uniform samplerBuffer cloths;   // ClothRecord
layout(binding = 1) uniform samplerBuffer systems;  // SystemRecord
layout(binding = 2) uniform samplerBuffer chunks;   // ChunkRecord

const uint kWalk = CLOTHSTREAM_SOLVE_WALK;

// The vectors of a solve, which lie one after the other: residual r, w: the preconditioner, 0 for pinned
// nodes; direction p; A p; A z, z the preconditioned residual; what is solved for.
const uint kResiduals = 0, kDirections = 1, kImages = 2, kProducts = 3, kCorrections = 4;

// Of a chunk: it has something to solve; what it had is to be cleared, or it has.
const uint kActive = 1, kPrepared = 2;

// A software device runs what a branch leaves out too, masked, and a loop that tests first once more than it
// must. Loops over lanes and chunks therefore test last, with a bound of 0 where there is nothing to do;
// their counts do not differ between invocations, as width() divides kLanes.

struct System {
  uint number;
  int cloth;  // first texel of its record
  uint firstNode, nodes;
  uint rows, columns;  // of a grid
  uint firstChunk, chunks;
  uint firstSpring, springs;
};

System systemAt(uint number) {
  int record = CLOTHSTREAM_SYSTEM_TEXELS * int(number);
  vec4 springs = texelFetch(systems, record);
  vec4 nodes = texelFetch(systems, record + 1);
  vec4 part = texelFetch(systems, record + 2);
  System system;
  system.number = number;
  system.cloth = CLOTHSTREAM_CLOTH_TEXELS * int(springs.w);
  system.firstSpring = wholeNumber(springs.x, springs.y);
  system.springs = uint(springs.z);
  system.firstNode = uint(nodes.x);
  system.nodes = uint(nodes.y);
  system.rows = uint(nodes.z);
  system.columns = uint(nodes.w);
  system.firstChunk = uint(part.x);
  system.chunks = uint(part.y);
  return system;
}

// The nodes of a walk: first + k * step for k < count. One past the last lies on the last, and has none.
struct Walk {
  uint first, step, count;
  uint row, column;  // of a grid: where it starts
};

Walk walkAt(System system, uint number) {
  Walk walk;
  if (kMesh) {
    uint start = number * kWalk;
    walk.row = walk.column = 0;
    walk.first = system.firstNode + min(start, system.nodes - 1);
    walk.step = 1;
    walk.count = start < system.nodes ? min(kWalk, system.nodes - start) : 0;
  } else {
    uint row = number / system.columns * kWalk;
    walk.row = min(row, system.rows - 1);
    walk.column = number % system.columns;
    walk.first = system.firstNode + walk.row * system.columns + walk.column;
    walk.step = system.columns;
    walk.count = row < system.rows ? min(kWalk, system.rows - row) : 0;
  }
  return walk;
}

#endif
