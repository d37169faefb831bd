// SPDX-License-Identifier: MIT
// Tables and push constants of the kernels that assemble the system matrix of constraints. C++ and GLSL use
// the same layout.
#ifndef CLOTHSTREAM_SHADERS_ASSEMBLED_ASSEMBLED_H
#define CLOTHSTREAM_SHADERS_ASSEMBLED_ASSEMBLED_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Whole numbers in these tables are below 2^24. Rows count through all systems, one per constraint
// (shared::LinkRecord).

// Rows that a lane of a chunk has; they are CLOTHSTREAM_SOLVE_LANES apart.
#define CLOTHSTREAM_ASSEMBLED_LANE_ROWS 4
#define CLOTHSTREAM_ASSEMBLED_CHUNK_ROWS (CLOTHSTREAM_ASSEMBLED_LANE_ROWS * CLOTHSTREAM_SOLVE_LANES)

// The system of one cloth.
struct AssembledSystemRecord {
  float cloth;
  float firstRow;
  float endRow;
  float firstChunk;
};

// A workgroup of most of these kernels. Every system has at least one.
struct AssembledChunkRecord {
  float system;
  float chunk;       // in the system
  float chunkCount;  // of the system
  float reserved;
};

// The texels that list the entries of a row of the system matrix, or of a column of J.
struct EntriesRecord {
  float firstTexel;
  float endTexel;
  float reserved0, reserved1;
};

// Four entries of a list.
//
// A row of the system matrix has two such lists. One names the columns. The other says what each entry is
// made of: 2 p + q if node p of the row is node q of the column, CLOTHSTREAM_DIAGONAL, or
// CLOTHSTREAM_NO_ENTRY, which fills the last texel. A column of J has one list: 2 row + p, or -1.
struct NumbersRecord {
  vec4 four;
};
#define CLOTHSTREAM_DIAGONAL 4
#define CLOTHSTREAM_NO_ENTRY 5

// A workgroup of the kernel that moves the nodes.
struct NodeRangeRecord {
  float cloth;
  float firstNode;  // in the scene
  float endNode;
  float reserved;
};

struct AssemblePush {
  float substepRate;  // 1/s
};

struct MultiplierPush {
  uint32_t rows;            // of all systems
  uint32_t firstSystem;     // if one workgroup solves a system
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  uint32_t firstChunk;  // if several workgroups solve a system
  uint32_t measures;    // 1: one more product measures the residual after the last iteration
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
#else

AssembledSystemRecord assembledSystemAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return AssembledSystemRecord(CLOTHSTREAM_FLOATS(texel));
}

AssembledChunkRecord assembledChunkAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return AssembledChunkRecord(CLOTHSTREAM_FLOATS(texel));
}

EntriesRecord entriesAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return EntriesRecord(CLOTHSTREAM_FLOATS(texel));
}

NodeRangeRecord nodeRangeAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return NodeRangeRecord(CLOTHSTREAM_FLOATS(texel));
}

// The state of a row; the other texel of the row has A r as its first component.
struct RowState {
  float residual;    // r
  float direction;   // p
  float image;       // A p
  float multiplier;  // lambda
};

RowState rowStateFrom(vec4 texel) {
  return RowState(CLOTHSTREAM_FLOATS(texel));
}

vec4 texelFrom(RowState state) {
  return vec4(state.residual, state.direction, state.image, state.multiplier);
}

// One of the two blocks of a row of J.
struct JacobianBlock {
  vec3 gradient;
  float inverseMass;  // of the column's node
};

JacobianBlock jacobianBlockAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return JacobianBlock(CLOTHSTREAM_VECTOR(texel));
}

#endif

#endif
