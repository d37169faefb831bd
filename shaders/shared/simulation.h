// SPDX-License-Identifier: MIT
// Tables and push constants of the simulation kernels, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H
#define CLOTHSTREAM_SHADERS_SHARED_SIMULATION_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Kernels read these tables as texels of four floats, which costs a software device a tenth of storage loads.
// Whole numbers are floats too, exact below 2^24.

// One cloth: where its nodes lie in the scene's buffers, its material and its solver. Row-major, SI units.
#define CLOTHSTREAM_CLOTH_TEXELS 10
#define CLOTHSTREAM_XPBD_TEXEL 7
struct ClothRecord {
  vec4 place;      // first node modulo 2^16, first node / 2^16, rows, columns; of a mesh: 0, nodes
  vec4 spacing;    // of columns, of rows, along the diagonal; damping
  vec4 stiffness;  // structural, shear, bend; friction
  vec4 damping;    // structural, shear, bend; thickness
  vec4 air;        // drag, lift; of self-collision: radius, friction
  vec4 solver;  // compliance / h^2, iterations, square of the tolerance; whether bend springs are solved for
  vec4 limits;  // stretch that springs are held at; part of more that is taken back; 0: always; flexural
                // rigidity
  // Of xpbd: structural, shear, bend as model::XpbdSpring; of their w the first is the number of iterations,
  // the second the inverse mass of a grid's nodes.
  vec4 springs[3];
};

// One workgroup of a kernel that walks down columns: its first invocation starts at (row, column) of the
// cloth. The others follow along the row, and from its end at the start of the next strip of rows.
struct TileRecord {
  vec4 start;  // cloth, row, column
};

// Nodes that one invocation of a solve walks along, and walks in a chunk: the lanes of its sums.
#define CLOTHSTREAM_SOLVE_WALK 4
#define CLOTHSTREAM_SOLVE_LANES 64

// One cloth that a linear system is solved for.
#define CLOTHSTREAM_SYSTEM_TEXELS 3
struct SystemRecord {
  vec4 springs;  // of a mesh: the first modulo 2^16, the first / 2^16, how many; of all: the cloth
  vec4 nodes;    // the first, how many; of a grid: rows, columns
  vec4 chunks;   // the first, how many
};

// A workgroup of most of a solve's kernels.
struct ChunkRecord {
  vec4 part;  // system, which of its chunks
};

// A spring of a mesh: its two nodes in the scene, its length. Its last number is the cloth times
// CLOTHSTREAM_SPRING_KINDS, plus its kind in the order of ClothRecord::stiffness.
#define CLOTHSTREAM_SPRING_KINDS 3
struct LinkRecord {
  vec4 ends;  // a, b, rest length; cloth and kind
};

// Two of the springs that meet at a node: the number of a spring of the cloth plus one, negative where the
// node is its second end, and the other end in the scene; 0 and the node itself fill the last texel.
struct SpringEndsRecord {
  vec4 two;  // number, other end; number, other end
};

// Which springs meet at a node of a mesh: SpringEndsRecords.
struct IncidenceRecord {
  vec4 list;  // the first texel modulo 2^16, the first / 2^16, how many texels
};

// What a solve says of itself, and what it goes on from.
struct SolveRecord {
  uint32_t iterations;
  float residual;        // its norm, relative to where it started
  uint32_t constraints;  // active ones
  uint32_t running;      // whether this iteration takes a step
  float start;           // square of the residual's norm when it started, and in this iteration
  float square;
  float stepLength;  // of this iteration, and how much of the last direction is in this one's
  float turn;
  uint32_t arrived;  // active chunks times 2^16, those that have done this iteration
};

// A workgroup of a kernel that corrects springs.
struct XpbdTile {
  vec4 start;  // cloth; of a grid: the first block, the first multiplier modulo 2^24, and / 2^24;
               // of a mesh: the first colour, colours
};

// A colour of a mesh that one workgroup corrects.
struct ColourRecord {
  vec4 springs;  // the first modulo 2^24, and / 2^24; how many
};

// A spring of a mesh that is corrected.
struct XpbdLinkRecord {
  vec4 ends;  // a, b, rest length; structural, shear or bend: 0, 1, 2
};

// What differs from substep to substep and from tick to tick.
struct AdvancePush {
  vec4 gravityStep;  // w: seconds of a substep
  vec4 windAir;      // w: air density / 6, half of it for each of a triangle's three nodes
  CollisionPush collision;
  uint32_t firstTile;
  uint32_t reserved0, reserved1, reserved2;
};

struct RungeKuttaPush {
  CollisionPush collision;
  uint32_t firstNode;
  uint32_t count;
  uint32_t cloth;
  uint32_t reserved;
};

struct PreparePush {
  uint32_t nodes;  // of the scene
  uint32_t firstChunk;
  uint32_t chunks;
  uint32_t smallSystems;  // which one workgroup solves each
  uint32_t firstLargeChunk;
  uint32_t largeChunks;
  uint32_t firstGroup;  // where the number of workgroups goes: of chunks, of small systems, of large chunks
  float substepSeconds;
  float substepRate;     // 1/s
  uint32_t firstSpring;  // of meshes
  uint32_t endSpring;
};

struct SolvePush {
  uint32_t nodes;           // of the scene
  uint32_t firstSystem;     // where one workgroup solves a system
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  uint32_t firstChunk;  // where several do
  uint32_t nextGroup;   // where their number goes if another iteration is to come
};

struct ApplyPush {
  CollisionPush collision;
  uint32_t nodes;  // of the scene
  uint32_t firstChunk;
  float substepSeconds;
  uint32_t reserved;
};

struct XpbdPush {
  uint32_t firstTile;
  uint32_t firstIteration;  // of this dispatch
  uint32_t endIteration;
  // Of a mesh, where a dispatch does one colour.
  uint32_t cloth;
  uint32_t firstSpring;
  uint32_t springs;
  uint32_t firstMultiplier;  // of all meshes
};

struct FinishPush {
  CollisionPush collision;
  float substepSeconds;
  float substepRate;  // 1/s
  uint32_t firstTile;
  uint32_t reserved;
};

struct HashPush {
  uint32_t nodeCount;
};

// What a tick says of its state. Sums of the nodes' hashes modulo 2^32: their order does not matter.
struct StatusRecord {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t unhealthy;  // not 0: some component is not finite, or outside the world
  uint32_t reserved;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(ClothRecord) == CLOTHSTREAM_CLOTH_TEXELS * sizeof(vec4) &&
              offsetof(ClothRecord, spacing) == 16 && offsetof(ClothRecord, stiffness) == 32 &&
              offsetof(ClothRecord, damping) == 48 && offsetof(ClothRecord, air) == 64 &&
              offsetof(ClothRecord, solver) == 80 && offsetof(ClothRecord, limits) == 96 &&
              offsetof(ClothRecord, springs) == CLOTHSTREAM_XPBD_TEXEL * sizeof(vec4));
static_assert(sizeof(XpbdTile) == 16 && sizeof(ColourRecord) == 16 && sizeof(XpbdLinkRecord) == 16);
static_assert(sizeof(XpbdPush) == 28 && sizeof(FinishPush) == 48);
static_assert(sizeof(SystemRecord) == CLOTHSTREAM_SYSTEM_TEXELS * sizeof(vec4));
static_assert(sizeof(SolveRecord) == 36 && sizeof(PreparePush) == 44 && sizeof(SolvePush) == 24 &&
              sizeof(ApplyPush) == 48 && sizeof(RungeKuttaPush) == 48);
static_assert(sizeof(TileRecord) == 16);
static_assert(sizeof(AdvancePush) == 80 && offsetof(AdvancePush, windAir) == 16 &&
              offsetof(AdvancePush, collision) == 32 && offsetof(AdvancePush, firstTile) == 64);
static_assert(sizeof(HashPush) == 4);
static_assert(sizeof(StatusRecord) == 16 && offsetof(StatusRecord, unhealthy) == 8);
}  // namespace clothstream::shared
#endif

#endif
