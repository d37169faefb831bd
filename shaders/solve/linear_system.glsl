// SPDX-License-Identifier: MIT
// A cloth's linear system and the partition of its nodes, shared by the kernels of a solve.
//
// The unknown is the change u of the nodes' velocities. With d from one end of a spring to the other,
//   (c M + sum of along d d^T + across I) u = side,
// where c and the `along` and `across` of each spring follow from the solver: spring_weight.glsl.
//
// A walk has kWalk nodes (rows of a column, or consecutive nodes), and a chunk has kLanes walks. Dot products
// add up along the walk, then the lanes of a chunk in a tree, then the chunks in lanes and a tree. This order
// does not depend on the device, on the workgroup's size, or on which workgroup handles which chunk.
#ifndef CLOTHSTREAM_SHADERS_SOLVE_LINEAR_SYSTEM_GLSL
#define CLOTHSTREAM_SHADERS_SOLVE_LINEAR_SYSTEM_GLSL

#extension GL_EXT_control_flow_attributes : require

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/fixed_sums.glsl"
#include "shaders/shared/simulation.h"
#include "shaders/shared/whole_number.h"

// True: implicit Euler, springs are forces. False: springs are constraints.
layout(constant_id = 1) const bool kImplicit = false;
layout(constant_id = 2) const bool kMesh = false;
// True if the system of any grid has bend springs.
layout(constant_id = 3) const bool kBend = true;
// ACAD, [Va21] 3.3: only springs that would be stretched too far are constraints.
layout(constant_id = 4) const bool kAdaptive = false;
// The paper's ACAD: such a spring is a constraint to its rest length and has no force.
layout(constant_id = 7) const bool kPaper = false;
// ACAD's one-sided limit: rounds of a solve, each from where the last one led.
const bool kLimit = kAdaptive && !kPaper;

layout(binding = 0) uniform samplerBuffer cloths;   // ClothRecord
layout(binding = 1) uniform samplerBuffer systems;  // SystemRecord
layout(binding = 2) uniform samplerBuffer chunks;   // ChunkRecord

const uint kWalk = CLOTHSTREAM_SOLVE_WALK;

// The vectors of a solve, one after the other in their buffer: residual r (ResidualRecord), direction p, A p,
// A z with z the preconditioned residual, the solution u, and with kLimit its sum over the rounds.
const uint kResiduals = 0, kDirections = 1, kImages = 2, kProducts = 3, kCorrections = 4, kTotals = 5;

// The residual of a node.
struct ResidualRecord {
  vec3 residual;
  float preconditioner;  // 0 for pinned nodes
};

ResidualRecord residualFrom(vec4 texel) {
  return ResidualRecord(CLOTHSTREAM_VECTOR(texel));
}

// c of a cloth's system.
float massFactor(ClothRecord cloth) {
  return kImplicit ? 1.0 : cloth.scaledCompliance;
}

// `along` or `across` of the springs of a grid's node, two texels. The texels of `along` also have c.
struct SpringWeights {
  float right;
  float below;
  float rightBelow;
  float rightToBelow;  // the spring from the right neighbour to the node below this one
  float secondRight;
  float secondBelow;
  float mass;  // of `along`: massFactor()
  float reserved;
};

SpringWeights springWeightsAt(samplerBuffer table, uint node) {
  vec4 near = texelFetch(table, 2 * int(node));
  vec4 far = texelFetch(table, 2 * int(node) + 1);
  return SpringWeights(CLOTHSTREAM_FLOATS(near), CLOTHSTREAM_FLOATS(far));
}
vec4 firstTexelOf(SpringWeights weights) {
  return vec4(weights.right, weights.below, weights.rightBelow, weights.rightToBelow);
}
vec4 secondTexelOf(SpringWeights weights) {
  return vec4(weights.secondRight, weights.secondBelow, weights.mass, weights.reserved);
}

// The terms of a spring of a mesh.
struct WeightedSpring {
  vec3 row;  // d times the square root of `along`
  float across;
};

WeightedSpring weightedSpringAt(samplerBuffer table, uint spring) {
  vec4 texel = texelFetch(table, int(spring));
  return WeightedSpring(CLOTHSTREAM_VECTOR(texel));
}

// Flags of a chunk: it has something to solve; its vectors must be prepared (or cleared); it was solved in
// the round before.
const uint kActive = 1, kPrepared = 2, kContinued = 4;

// A software device also runs the masked-out side of a branch, and runs a loop that tests first once more
// than needed. Loops over lanes and chunks therefore test last, with a bound of 0 if there is nothing to do.
// Their counts do not differ between invocations, because width() divides kLanes.

struct System {
  uint number;
  uint cloth;
  uint firstNode, nodes;
  uint rows, columns;  // of a grid
  uint firstChunk, chunks;
  uint firstSpring, springs;
};

System systemAt(uint number) {
  SystemRecord record = systemRecordAt(systems, number);
  System system;
  system.number = number;
  system.cloth = uint(record.cloth);
  system.firstSpring = wholeNumber(record.firstSpringLow, record.firstSpringHigh);
  system.springs = uint(record.springCount);
  system.firstNode = uint(record.firstNode);
  system.nodes = uint(record.nodeCount);
  system.rows = uint(record.rows);
  system.columns = uint(record.columns);
  system.firstChunk = uint(record.firstChunk);
  system.chunks = uint(record.chunkCount);
  return system;
}

// The nodes of a walk: first + k * step for k < count. A walk past the last node starts at that node and has
// count 0.
struct Walk {
  uint first, step, count;
  uint row, column;  // of a grid: first node
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
