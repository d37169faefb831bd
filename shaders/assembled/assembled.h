// SPDX-License-Identifier: MIT
// Tables and push constants of the kernels that assemble the constraints' system, laid out alike in C++ and
// in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_ASSEMBLED_ASSEMBLED_H
#define CLOTHSTREAM_SHADERS_ASSEMBLED_ASSEMBLED_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Read as texels of four floats, as the tables of simulation.h are; here whole numbers are all below 2^24.
// Rows are those of all systems together, one a constraint: shared::LinkRecord.

// Rows that a lane of a chunk has, CLOTHSTREAM_SOLVE_LANES apart.
#define CLOTHSTREAM_ASSEMBLED_LANE_ROWS 4
#define CLOTHSTREAM_ASSEMBLED_CHUNK_ROWS (CLOTHSTREAM_ASSEMBLED_LANE_ROWS * CLOTHSTREAM_SOLVE_LANES)

// One cloth's system.
struct AssembledSystemRecord {
  vec4 rows;  // cloth; first row, one past the last; first chunk
};

// A workgroup of most of these kernels. Every system has one.
struct AssembledChunkRecord {
  vec4 part;  // system, which of its chunks, how many it has
};

// Where the entries of a row of the system matrix are listed, or those of a column of J.
struct EntriesRecord {
  vec4 range;  // first texel, one past the last
};

// Four entries of a list.
//
// Of a row of the system matrix, one table has the columns, one what the entries are made of: 2 p + q where
// the p-th node of the row is the q-th of the column, CLOTHSTREAM_DIAGONAL, or CLOTHSTREAM_NO_ENTRY, which
// fills the last texel. Of a column of J: 2 row + p, or -1.
struct NumbersRecord {
  vec4 four;
};
#define CLOTHSTREAM_DIAGONAL 4
#define CLOTHSTREAM_NO_ENTRY 5

// A workgroup of the kernel that moves the nodes.
struct NodeRangeRecord {
  vec4 part;  // cloth; in the scene: first node, one past the last
};

struct AssemblePush {
  float substepRate;  // 1/s
};

struct MultiplierPush {
  uint32_t rows;            // of all systems
  uint32_t firstSystem;     // where one workgroup solves a system
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  uint32_t firstChunk;  // where several do
  uint32_t measures;    // whether to say what is left after the last iteration: a product more
};

struct ApplyMultiplierPush {
  CollisionPush collision;
  float substepSeconds;
  uint32_t reserved0, reserved1, reserved2;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(AssembledSystemRecord) == 16 && sizeof(AssembledChunkRecord) == 16 &&
              sizeof(EntriesRecord) == 16 && sizeof(NumbersRecord) == 16 && sizeof(NodeRangeRecord) == 16);
static_assert(sizeof(AssemblePush) == 4 && sizeof(MultiplierPush) == 24 && sizeof(ApplyMultiplierPush) == 48);
}  // namespace clothstream::shared
#endif

#endif
