// SPDX-License-Identifier: MIT
// Tables and push constants of the simulation kernels. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H
#define CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H

#include "shaders/collision/collision.h"
#include "shaders/shared/cloth_record.h"
#include "shaders/shared/types.h"
#include "shaders/shared/whole_number.h"

CLOTHSTREAM_SHARED_BEGIN

// Kernels read these tables as texels of four floats: on a software device that costs a tenth of a load from
// a storage buffer. Each record has one function that decodes it (`...At`), in the order of its members.

// One workgroup of a kernel that walks down the columns of a grid. Its first invocation starts at (row,
// column). The others follow along the row and continue at the start of the next strip of rows.
struct TileRecord {
  float cloth;
  float row;
  float column;
  float reserved;
};

// One workgroup of a kernel that works on a mesh.
struct MeshTileRecord {
  float cloth;
  float firstNode;      // in the cloth
  float firstMeshNode;  // among the nodes of all meshes
  float reserved;
};

// Consecutive nodes that one invocation of a solve handles; lanes of a chunk and of its sums.
#define CLOTHSTREAM_SOLVE_WALK 4
#define CLOTHSTREAM_SOLVE_LANES 64

// One cloth whose linear system is solved.
#define CLOTHSTREAM_SYSTEM_TEXELS 3
struct SystemRecord {
  float firstSpringLow;  // of a mesh: wholeNumber(low, high)
  float firstSpringHigh;
  float springCount;
  float cloth;

  float firstNode;
  float nodeCount;
  float rows;  // of a grid
  float columns;

  float firstChunk;
  float chunkCount;
  float reserved0, reserved1;
};

// A workgroup of most kernels of a solve.
struct ChunkRecord {
  float system;
  float chunk;  // in the system
  float reserved0, reserved1;
};

// A spring of a mesh in a linear system. `clothAndKind` is the cloth times CLOTHSTREAM_SPRING_KINDS plus the
// kind: 0 structural, 1 shear, 2 bend.
#define CLOTHSTREAM_SPRING_KINDS 3
struct LinkRecord {
  float a;  // nodes in the scene
  float b;
  float restLength;  // m
  float clothAndKind;
};

// One end of a spring as the node at that end sees it. `signedSpring` is the number of the spring in the
// cloth plus one; it is negative if the node is the spring's second end, and 0 if there is no spring.
struct SpringEnd {
  float signedSpring;
  float other;  // node at the other end; the node itself if there is no spring
};

// Two of the springs that meet at a node. ListRecord says where the records of a node are.
struct SpringEndsRecord {
  SpringEnd ends[2];
};

// State and result of a solve.
struct SolveRecord {
  uint32_t iterations;
  float residual;        // norm, relative to its start
  uint32_t constraints;  // active ones
  uint32_t running;      // 1: this iteration takes a step
  float start;           // square of the residual's norm at the start
  float square;          // square of the residual's norm in this iteration
  float stepLength;      // alpha of this iteration
  float directionShare;  // beta: share of the last direction in the new one
  uint32_t arrived;      // active chunks times 2^16, plus chunks that finished this iteration
};

// A workgroup of a kernel that corrects springs or finishes a substep. One table holds all three kinds.
struct XpbdGridTile {
  float cloth;
  float firstBlock;
  float firstMultiplierLow;  // modulo 2^24
  float firstMultiplierHigh;
};
struct XpbdMeshTile {
  float cloth;
  float firstColour;
  float colourCount;
  float reserved;
};
struct XpbdNodeTile {
  float cloth;
  float firstNode;  // in the cloth
  float reserved0, reserved1;
};

// A colour of a mesh that one workgroup corrects.
struct ColourRecord {
  float firstSpringLow;  // modulo 2^24
  float firstSpringHigh;
  float springCount;
  float reserved;
};

// A spring of a mesh that is corrected.
struct XpbdLinkRecord {
  float a;  // nodes in the scene
  float b;
  float restLength;  // m
  float kind;        // 0 structural, 1 shear, 2 bend
};

struct AdvancePush {
  vec3 gravity;       // m/s^2
  float stepSeconds;  // of a substep, or of a Runge-Kutta stage
  vec3 wind;          // m/s
  float airFactor;    // air density / 6: half of it, for each of a triangle's three nodes
  CollisionPush collision;
  uint32_t firstTile;
  uint32_t stretchSize;    // of grids with ACAD: index of the dispatch size that a stretched spring sets
  uint32_t stretchGroups;  // the x of that size
  uint32_t firstMark;      // index of the mark of the scene's first node (StateBuffers)
  uint32_t localWinds;     // number of them
};

struct RungeKuttaPush {
  CollisionPush collision;
  uint32_t firstNode;
  uint32_t count;
  uint32_t cloth;
  uint32_t reserved;
};

struct PreparePush {
  uint32_t nodes;  // in the scene
  uint32_t firstChunk;
  uint32_t chunks;
  uint32_t smallSystems;  // systems that one workgroup solves each
  uint32_t firstLargeChunk;
  uint32_t largeChunks;
  uint32_t firstGroup;  // index of the dispatch sizes: of all chunks, of small systems, of large chunks
  float substepSeconds;
  float substepRate;     // 1/s
  uint32_t firstSpring;  // of meshes
  uint32_t endSpring;
  uint32_t round;  // of this substep, from 0
};

struct SolvePush {
  uint32_t nodes;           // in the scene
  uint32_t firstSystem;     // if one workgroup solves a system
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  uint32_t firstChunk;  // if several workgroups solve a system
  uint32_t nextGroup;   // index of the dispatch size of the next iteration
};

// Most invocations of a workgroup that solves only for stretched springs, and chunks of its cloth.
#define CLOTHSTREAM_STRETCHED_INVOCATIONS 512
#define CLOTHSTREAM_STRETCHED_CHUNKS 256

struct StretchedPush {
  uint32_t nodes;  // in the scene
  uint32_t firstSystem;
  uint32_t systems;
  uint32_t rounds;       // of a solve
  uint32_t stretchSize;  // index of the dispatch size of this kernel: the kernel clears it
  uint32_t nextSize;     // of the kernel that continues long solves
  uint32_t firstMark;    // as in AdvancePush
  uint32_t mostLoops;    // rounds of loops that an invocation may take
  float substepSeconds;
  float substepRate;  // 1/s
  uint32_t collides;  // 1: the nodes collide afterwards
  uint32_t reserved;
};

// Springs that a node of a grid owns, by bit of its mark: to the right, below, right below, left below,
// second to the right, second below.
#define CLOTHSTREAM_GRID_SPRINGS 6
// Springs of a mesh that a mark has.
#define CLOTHSTREAM_MARKED_SPRINGS 32

struct MarkPush {
  uint32_t nodes;  // in the scene
  uint32_t firstChunk;
  uint32_t firstSpring;  // of meshes
  uint32_t endSpring;
  uint32_t firstMark;  // of these springs
};

struct ApplyPush {
  CollisionPush collision;
  uint32_t nodes;  // in the scene
  uint32_t firstChunk;
  float substepSeconds;
  uint32_t firstGroup;  // as in PreparePush
  uint32_t listed;      // 1: the workgroups handle the listed chunks
  uint32_t reserved0, reserved1, reserved2;
};

struct XpbdPush {
  uint32_t firstTile;
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  // For a dispatch that corrects one colour of a mesh:
  uint32_t cloth;
  uint32_t firstSpring;
  uint32_t springs;
  uint32_t firstMultiplier;  // of all meshes
  uint32_t zero;             // 0, which compilers do not know (correct_grids.comp)
};

struct FinishPush {
  CollisionPush collision;
  float substepSeconds;
  float substepRate;  // 1/s
  uint32_t firstTile;
  uint32_t reserved;
};

struct HashPush {
  vec3 origin;  // of the positions, m
  uint32_t nodeCount;
  uint32_t reach;  // bits of the largest magnitude of a component of a position, m
};

// A component is not finite or outside the world; a component of a position is beyond HashPush::reach.
const uint32_t kOutsideWorld = 1;
const uint32_t kOutOfReach = 2;

// Result of a tick. The hash is the sum of the nodes' hashes modulo 2^32, so that their order does not
// matter.
struct StatusRecord {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t unhealthy;  // kOutsideWorld, kOutOfReach, or both
  uint32_t reserved;
  // Box of the positions, as orderOf() the bits of its components. Those of the low end are inverted, so that
  // both are largest values.
  uint32_t invertedLow[3];
  uint32_t high[3];
  uint32_t reserved1[2];
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(TileRecord) == 16 && sizeof(MeshTileRecord) == 16 && sizeof(ListRecord) == 16);
static_assert(sizeof(SystemRecord) == CLOTHSTREAM_SYSTEM_TEXELS * sizeof(vec4) && sizeof(ChunkRecord) == 16 &&
              sizeof(LinkRecord) == 16 && sizeof(SpringEndsRecord) == 16);
static_assert(sizeof(XpbdGridTile) == 16 && sizeof(XpbdMeshTile) == 16 && sizeof(XpbdNodeTile) == 16 &&
              sizeof(ColourRecord) == 16 && sizeof(XpbdLinkRecord) == 16);
static_assert(sizeof(AdvancePush) == 84 && offsetof(AdvancePush, wind) == 16 &&
              offsetof(AdvancePush, collision) == 32 && offsetof(AdvancePush, firstTile) == 64);
static_assert(sizeof(SolveRecord) == 36 && sizeof(PreparePush) == 48 && sizeof(SolvePush) == 24 &&
              sizeof(ApplyPush) == 64 && sizeof(RungeKuttaPush) == 48 && sizeof(XpbdPush) == 32 &&
              sizeof(FinishPush) == 48 && sizeof(StretchedPush) == 48 && sizeof(MarkPush) == 20 &&
              sizeof(HashPush) == 20);
static_assert(sizeof(StatusRecord) == 48 && offsetof(StatusRecord, unhealthy) == 8 &&
              offsetof(StatusRecord, high) == 28);
}  // namespace clothstream::shared
#else

TileRecord tileAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return TileRecord(CLOTHSTREAM_FLOATS(texel));
}

MeshTileRecord meshTileAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return MeshTileRecord(CLOTHSTREAM_FLOATS(texel));
}

SystemRecord systemRecordAt(samplerBuffer table, uint number) {
  int first = CLOTHSTREAM_SYSTEM_TEXELS * int(number);
  vec4 springs = texelFetch(table, first);
  vec4 nodes = texelFetch(table, first + 1);
  vec4 chunks = texelFetch(table, first + 2);
  return SystemRecord(CLOTHSTREAM_FLOATS(springs), CLOTHSTREAM_FLOATS(nodes), CLOTHSTREAM_FLOATS(chunks));
}

ChunkRecord chunkAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return ChunkRecord(CLOTHSTREAM_FLOATS(texel));
}

LinkRecord linkAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return LinkRecord(CLOTHSTREAM_FLOATS(texel));
}

SpringEndsRecord springEndsAt(samplerBuffer table, int texel) {
  vec4 ends = texelFetch(table, texel);
  return SpringEndsRecord(SpringEnd[2](SpringEnd(ends.x, ends.y), SpringEnd(ends.z, ends.w)));
}

XpbdGridTile xpbdGridTileAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return XpbdGridTile(CLOTHSTREAM_FLOATS(texel));
}

XpbdMeshTile xpbdMeshTileAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return XpbdMeshTile(CLOTHSTREAM_FLOATS(texel));
}

XpbdNodeTile xpbdNodeTileAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return XpbdNodeTile(CLOTHSTREAM_FLOATS(texel));
}

ColourRecord colourAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return ColourRecord(CLOTHSTREAM_FLOATS(texel));
}

XpbdLinkRecord xpbdLinkAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return XpbdLinkRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

#endif
