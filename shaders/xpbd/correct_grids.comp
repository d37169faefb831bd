// SPDX-License-Identifier: MIT
// Corrects the springs of grids in the order of model::springColours(): corners, seams, insides.
//
// An invocation loads a block of 4x4 nodes into registers and corrects its springs there, one after the
// other. A sweep then reads and writes each node 2.5 times instead of the 12 times of a pass per colour.
// Writes cannot race: within a pass, no two blocks share a node that either of them reads. A workgroup
// handles one pass of some blocks, or all passes of a whole cloth with barriers between; the bits are the
// same.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "shaders/xpbd/spring.glsl"

layout(local_size_x_id = 0) in;
// Bits: corners, seams, insides. All three bits: a workgroup handles a whole cloth.
layout(constant_id = 3) const uint kPasses = 7;
layout(constant_id = 4) const bool kBend = true;
// True: places at the substep's start are read for each spring instead of kept in registers, which suits
// GPUs. The bits are the same.
layout(constant_id = 5) const bool kFewRegisters = false;

layout(binding = 0) uniform samplerBuffer cloths;          // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;           // XpbdGridTile
layout(binding = 2) uniform samplerBuffer startPositions;  // at the substep's start
// The same memory twice: a software device reads texels three times as fast as storage and writes storage
// five times as fast as texels.
layout(binding = 3, rgba32f) uniform coherent readonly imageBuffer nodeTexels;
layout(std430, binding = 4) buffer Positions {
  vec4 positions[];  // w: inverse mass
};
layout(std430, binding = 5) buffer Multipliers {
  float multipliers[];
};

layout(push_constant) uniform Push {
  XpbdPush push;
};

const uint kCorners = 1, kSeams = 2, kInsides = 4;
const bool kWhole = kPasses == 7;
const uint kSize = 4;
// Number of colours of each pass.
const uint kCornerColours = 4, kSeamColours = 34, kInsideColours = 58;
// Inverse mass of a node beyond the grid's edge. Every sum with it is below zero.
const float kAbsent = -1e30;

// A kind of spring of the cloth, and its inverse resistance with one free end and with two.
struct Rule {
  Spring spring;
  float one;
  float both;
};

struct Grid {
  int firstNode;
  int rows;
  int columns;
  uint firstMultiplier;
  float inverseMass;  // of a node that is not pinned
  Rule alongRow, alongColumn, shear, bendRow, bendColumn;
};

Grid grid;

// The nodes of the block, row by row, and their places at the substep's start.
vec4 nodes[kSize * kSize];
vec3 begun[kSize * kSize];
bool keepsBegun;  // false: `begun` is not used
// Node of a place in the block: rowStarts[row] + columns[column]. Beyond the grid's edge it is the node on
// the edge. Corners reach one row and one column farther than a block.
int rowStarts[kSize + 1];
int columns[kSize + 1];
// The block's first multiplier, and the distance from a colour's multiplier to that of the next colour.
uint multiplierAt;
uint multiplierStride;
bool again;   // true from the second sweep of a substep on
bool exists;  // false: no node of the block is in the grid

Rule ruleOf(XpbdSpringRecord record, float restLength, float inverseMass) {
  Spring spring = springFrom(record, restLength);
  precise float both = 2.0 * inverseMass;
  return Rule(spring, inverseResistance(spring, inverseMass), inverseResistance(spring, both));
}

Grid gridOf(XpbdGridTile tile, ClothRecord cloth) {
  XpbdSpringRecord structural = cloth.xpbdSprings[0], shear = cloth.xpbdSprings[1],
                   bend = cloth.xpbdSprings[2];
  float inverseMass = cloth.gridInverseMass;
  precise float bendRow = 2.0 * cloth.columnSpacing;
  precise float bendColumn = 2.0 * cloth.rowSpacing;
  return Grid(int(firstNodeOf(cloth)), int(cloth.rows), int(cloth.columns),
              uint(tile.firstMultiplierLow) + (uint(tile.firstMultiplierHigh) << 24), inverseMass,
              ruleOf(structural, cloth.columnSpacing, inverseMass),
              ruleOf(structural, cloth.rowSpacing, inverseMass),
              ruleOf(shear, cloth.diagonalSpacing, inverseMass), ruleOf(bend, bendRow, inverseMass),
              ruleOf(bend, bendColumn, inverseMass));
}

// `row` and `column` are of the block's first node, which may lie outside the grid.
void locate(int row, int column) {
  [[unroll]] for (int k = 0; k <= int(kSize); ++k) {
    rowStarts[k] = grid.firstNode + clamp(row + k, 0, grid.rows - 1) * grid.columns;
    columns[k] = clamp(column + k, 0, grid.columns - 1);
  }
}

// Loads the node at a place in the block into nodes[at].
void load(uint at, uint placeRow, uint placeColumn, int row, int column) {
  row += int(placeRow);
  column += int(placeColumn);
  bool inside = row >= 0 && row < grid.rows && column >= 0 && column < grid.columns;
  int index = rowStarts[placeRow] + columns[placeColumn];
  vec4 node = kFewRegisters ? positions[index] : imageLoad(nodeTexels, index);
  nodes[at] = vec4(node.xyz, inside ? node.w : kAbsent);
  if (keepsBegun) {
    begun[at] = texelFetch(startPositions, index).xyz;
  }
}

void store(uint at, uint placeRow, uint placeColumn) {
  if (nodes[at].w > 0.0) {
    positions[rowStarts[placeRow] + columns[placeColumn]].xyz = snapTiny(nodes[at].xyz);
  }
}

// Place of a block's node at the substep's start. `push.zero` hides from the compiler that two springs read
// the same texel, because it would keep the texel in registers between them.
vec3 begunAt(uint at, uint colour) {
  if (keepsBegun) {
    return begun[at];
  }
  int index = rowStarts[at / kSize] + columns[at % kSize] + int(push.zero * (colour + 1));
  return texelFetch(startPositions, index).xyz;
}

void correct(uint a, uint b, Rule rule, uint colour) {
  precise vec3 d = nodes[b].xyz - nodes[a].xyz;
  precise vec3 before = begunAt(b, colour) - begunAt(a, colour);
  precise float inverseMasses = nodes[a].w + nodes[b].w;
  precise float nearlyBoth = 1.5 * grid.inverseMass;
  float inverse = inverseMasses > nearlyBoth ? rule.both : (inverseMasses > 0.0 ? rule.one : 0.0);
  uint at = multiplierAt + colour * multiplierStride;
  float multiplier = 0.0;
  if (kIterated && again) {
    multiplier = multipliers[at];
  }
  vec3 pull = pullOf(d, before, nodes[a].xyz, rule.spring, inverse, multiplier);
  if (kIterated && exists) {
    multipliers[at] = multiplier;
  }
  precise vec3 movedA = nodes[a].xyz - nodes[a].w * pull;
  precise vec3 movedB = nodes[b].xyz + nodes[b].w * pull;
  nodes[a].xyz = movedA;
  nodes[b].xyz = movedB;
}

// Corrects the shear springs of a quad with corners a b above e f.
void correctShear(uint a, uint b, uint e, uint f, uint colour) {
  correct(a, f, grid.shear, colour);
  correct(b, e, grid.shear, colour + 1);
}

// Blocks of a pass: model::blockLine() along the columns and along the rows.
struct Blocks {
  int firstRow;
  int firstColumn;
  uint perRow;
  float inversePerRow;
  uint count;
  uint firstMultiplier;
};

int firstOfLine(int nodes, bool seams) {
  return ((nodes & 3) == 2 ? -1 : 0) - (seams ? 2 : 0);
}

uint countOfLine(int nodes, int first) {
  return uint(nodes - first + 3) / 4;
}

Blocks blocksOf(bool seams, uint firstMultiplier) {
  int firstRow = firstOfLine(grid.rows, seams);
  int firstColumn = firstOfLine(grid.columns, seams);
  uint perRow = countOfLine(grid.columns, firstColumn);
  return Blocks(firstRow, firstColumn, perRow, reciprocal(float(perRow)),
                perRow * countOfLine(grid.rows, firstRow), firstMultiplier);
}

void placeBlock(uint block, Blocks blocks, out int row, out int column) {
  // A software device divides one lane at a time, so that this multiplies. It is exact below a million
  // blocks.
  precise float quotient = (float(block) + 0.5) * blocks.inversePerRow;
  uint blockRow = uint(quotient);
  row = blocks.firstRow + int(kSize * blockRow);
  column = blocks.firstColumn + int(kSize * (block - blockRow * blocks.perRow));
  locate(row, column);
  exists = block < blocks.count;
  multiplierAt = blocks.firstMultiplier + (exists ? block : 0);
  multiplierStride = blocks.count;
}

void correctCorners(uint block, Blocks blocks) {
  int row, column;
  placeBlock(block, blocks, row, column);
  keepsBegun = true;
  [[unroll]] for (uint k = 0; k < 4; ++k) {
    load(k, 1 + k / 2, 3 + k % 2, row, column);
    load(4 + k, 3 + k / 2, 1 + k % 2, row, column);
  }
  correctShear(0, 1, 2, 3, 0);
  correctShear(4, 5, 6, 7, 2);
  [[unroll]] for (uint k = 0; k < 4; ++k) {
    store(k, 1 + k / 2, 3 + k % 2);
    store(4 + k, 3 + k / 2, 1 + k % 2);
  }
}

// True if a spring crosses the middle of the block in either direction.
bool crosses(uint a, uint b) {
  return (a / 8 != b / 8) || (a % 4 / 2 != b % 4 / 2);
}

// Corrects all springs of an inside, or those that cross a seam.
void correctBlock(uint block, Blocks blocks, bool seams) {
  int row, column;
  placeBlock(block, blocks, row, column);
  keepsBegun = !kFewRegisters;
  [[unroll]] for (uint k = 0; k < kSize * kSize; ++k) {
    load(k, k / kSize, k % kSize, row, column);
  }
  uint colour = 0;
  if (kBend) {
    [[unroll]] for (uint k = 0; k < 8; ++k) {
      uint a = k % 4 * kSize + k / 4;
      if (!seams || crosses(a, a + 2)) {
        correct(a, a + 2, grid.bendRow, colour);
        ++colour;
      }
    }
    [[unroll]] for (uint a = 0; a < 8; ++a) {
      if (!seams || crosses(a, a + 2 * kSize)) {
        correct(a, a + 2 * kSize, grid.bendColumn, colour);
        ++colour;
      }
    }
  }
  // Springs that are mirror images of each other come before the others, as in the list of the model.
  [[unroll]] for (uint k = 0; k < 9; ++k) {
    uint a = k < 4   ? k / 2 * 2 * kSize + k % 2 * 2
             : k < 6 ? (k - 4) * 2 * kSize + 1
             : k < 8 ? kSize + (k - 6) * 2
                     : kSize + 1;
    if (!seams || crosses(a, a + kSize + 1)) {
      correctShear(a, a + 1, a + kSize, a + kSize + 1, colour);
      colour += 2;
    }
  }
  [[unroll]] for (uint k = 0; k < 12; ++k) {
    uint a = k < 8 ? k / 2 * kSize + k % 2 * 2 : (k - 8) * kSize + 1;
    if (!seams || crosses(a, a + 1)) {
      correct(a, a + 1, grid.alongRow, colour);
      ++colour;
    }
  }
  [[unroll]] for (uint k = 0; k < 12; ++k) {
    uint a = k < 8 ? k / 4 * 2 * kSize + k % 4 : kSize + k - 8;
    if (!seams || crosses(a, a + kSize)) {
      correct(a, a + kSize, grid.alongColumn, colour);
      ++colour;
    }
  }
  [[unroll]] for (uint k = 0; k < kSize * kSize; ++k) {
    store(k, k / kSize, k % kSize);
  }
}

// Every invocation makes the same number of rounds. Surplus rounds handle blocks beyond the grid.
#define PASS(CORRECT, count)                                                            \
  {                                                                                     \
    uint block = firstBlock + gl_LocalInvocationID.x;                                   \
    uint rounds = kWhole ? ((count) + gl_WorkGroupSize.x - 1) / gl_WorkGroupSize.x : 1; \
    do {                                                                                \
      CORRECT;                                                                          \
      block += gl_WorkGroupSize.x;                                                      \
      --rounds;                                                                         \
    } while (rounds > 0);                                                               \
    if (kWhole) {                                                                       \
      memoryBarrier();                                                                  \
      barrier();                                                                        \
    }                                                                                   \
  }

void main() {
  XpbdGridTile tile = xpbdGridTileAt(tiles, push.firstTile + gl_WorkGroupID.x);
  ClothRecord cloth = clothAt(cloths, uint(tile.cloth));
  grid = gridOf(tile, cloth);
  uint endIteration = min(uint(cloth.solverIterations), push.endIteration);
  if (push.firstIteration >= endIteration) {
    return;
  }
  uint firstBlock = uint(tile.firstBlock);
  Blocks corners = blocksOf(false, grid.firstMultiplier);
  Blocks seams = blocksOf(true, grid.firstMultiplier + kCornerColours * corners.count);
  Blocks insides = corners;
  insides.firstMultiplier = seams.firstMultiplier + kSeamColours * seams.count;

  uint iteration = push.firstIteration;
  do {
    again = iteration > 0;
    if ((kPasses & kCorners) != 0) {
      PASS(correctCorners(block, corners), corners.count)
    }
    if ((kPasses & kSeams) != 0) {
      PASS(correctBlock(block, seams, true), seams.count)
    }
    if ((kPasses & kInsides) != 0) {
      PASS(correctBlock(block, insides, false), insides.count)
    }
    ++iteration;
  } while (kWhole && iteration < endIteration);
}
