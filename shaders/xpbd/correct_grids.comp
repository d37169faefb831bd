// SPDX-License-Identifier: MIT
// Corrects the springs of grids, in the order of scene::springColours(): corners, seams, insides.
//
// An invocation takes a block of 4x4 nodes into registers and corrects its springs one after the other there:
// each node is read and written two and a half times a sweep instead of twelve times, which is what a sweep a
// colour would take. Writes cannot race: within a pass no two blocks share a node that either of them reads.
// A workgroup does one pass of some blocks, or all passes of a whole cloth with barriers between; the bits
// are the same.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "shaders/xpbd/spring.glsl"

layout(local_size_x_id = 0) in;
// Bits: corners, seams, insides. All three: of a whole cloth.
layout(constant_id = 3) const uint kPasses = 7;
layout(constant_id = 4) const bool kBend = true;

layout(binding = 0) uniform samplerBuffer cloths;          // ClothRecord
layout(binding = 1) uniform samplerBuffer tiles;           // XpbdTile
layout(binding = 2) uniform samplerBuffer startPositions;  // of the substep
layout(binding = 3) uniform samplerBuffer
    heldPositions;  // the same as the next, where nobody else writes them
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
// Colours of each pass.
const uint kCornerColours = 4, kSeamColours = 34, kInsideColours = 58;
// The inverse mass of a node beyond the grid's edge: with it no sum is above zero.
const float kAbsent = -1e30;

// A spring of the cloth, and its inverse resistances with one end pinned and with none.
struct Rule {
  Spring spring;
  float one;
  float both;
};

struct Cloth {
  int firstNode;
  int rows;
  int columns;
  uint firstMultiplier;
  float inverseMass;  // of a node that is not pinned
  Rule alongRow, alongColumn, shear, bendRow, bendColumn;
};

Cloth cloth;

// The block: its nodes row by row, where they were at the substep's start.
vec4 nodes[kSize * kSize];
vec3 begun[kSize * kSize];
int indices[kSize * kSize];
// Its multipliers: the first one, and from a colour's to the next colour's.
uint multiplierAt;
uint multiplierStride;
bool again;   // not the first sweep of the substep
bool exists;  // whether there is such a block at all: if not, none of its nodes is in the grid

Rule ruleOf(vec4 record, float restLength, float inverseMass) {
  Spring spring = springFrom(record, restLength);
  return Rule(spring, inverseResistance(spring, inverseMass), inverseResistance(spring, 2.0 * inverseMass));
}

Cloth locateCloth(vec4 tile) {
  int record = CLOTHSTREAM_CLOTH_TEXELS * int(tile.x);
  vec4 place = texelFetch(cloths, record);
  vec4 spacing = texelFetch(cloths, record + 1);
  vec4 structural = texelFetch(cloths, record + CLOTHSTREAM_XPBD_TEXEL);
  vec4 shear = texelFetch(cloths, record + CLOTHSTREAM_XPBD_TEXEL + 1);
  vec4 bend = texelFetch(cloths, record + CLOTHSTREAM_XPBD_TEXEL + 2);
  float inverseMass = shear.w;
  return Cloth(int(place.x) + (int(place.y) << 16), int(place.z), int(place.w),
               uint(tile.z) + (uint(tile.w) << 24), inverseMass, ruleOf(structural, spacing.x, inverseMass),
               ruleOf(structural, spacing.y, inverseMass), ruleOf(shear, spacing.z, inverseMass),
               ruleOf(bend, 2.0 * spacing.x, inverseMass), ruleOf(bend, 2.0 * spacing.y, inverseMass));
}

void load(uint at, int row, int column) {
  bool inside = row >= 0 && row < cloth.rows && column >= 0 && column < cloth.columns;
  int index =
      cloth.firstNode + clamp(row, 0, cloth.rows - 1) * cloth.columns + clamp(column, 0, cloth.columns - 1);
  vec4 node = kWhole ? positions[index] : texelFetch(heldPositions, index);
  nodes[at] = vec4(node.xyz, inside ? node.w : kAbsent);
  indices[at] = index;
  if (kDamped) {
    begun[at] = texelFetch(startPositions, index).xyz;
  }
}

void store(uint at) {
  if (nodes[at].w > 0.0) {
    positions[indices[at]].xyz = snapTiny(nodes[at].xyz);
  }
}

void correct(uint a, uint b, Rule rule, uint colour) {
  precise vec3 d = nodes[b].xyz - nodes[a].xyz;
  precise vec3 before = vec3(0.0);
  if (kDamped) {
    before = begun[b] - begun[a];
  }
  precise float inverseMasses = nodes[a].w + nodes[b].w;
  precise float nearlyBoth = 1.5 * cloth.inverseMass;
  float inverse = inverseMasses > nearlyBoth ? rule.both : (inverseMasses > 0.0 ? rule.one : 0.0);
  uint at = multiplierAt + colour * multiplierStride;
  float multiplier = 0.0;
  if (kIterated && again) {
    multiplier = multipliers[at];
  }
  vec3 pull = pullOf(d, before, rule.spring, inverse, multiplier);
  if (kIterated && exists) {
    multipliers[at] = multiplier;
  }
  precise vec3 movedA = nodes[a].xyz - nodes[a].w * pull;
  precise vec3 movedB = nodes[b].xyz + nodes[b].w * pull;
  nodes[a].xyz = movedA;
  nodes[b].xyz = movedB;
}

// Of a quad, its corners a b above e f.
void correctShear(uint a, uint b, uint e, uint f, uint colour) {
  correct(a, f, cloth.shear, colour);
  correct(b, e, cloth.shear, colour + 1);
}

void placeBlock(uint block, uint perRow, float inversePerRow, uint count, uint firstMultiplier, int shift,
                out int row, out int column) {
  // Without a division, which a software device does a lane at a time: exact while a cloth has below a
  // million blocks.
  precise float quotient = (float(block) + 0.5) * inversePerRow;
  uint blockRow = uint(quotient);
  row = int(kSize * blockRow) - shift;
  column = int(kSize * (block - blockRow * perRow)) - shift;
  exists = block < count;
  multiplierAt = firstMultiplier + (exists ? block : 0);
  multiplierStride = count;
}

void correctCorners(uint block, uint perRow, float inversePerRow, uint count, uint firstMultiplier) {
  int row, column;
  placeBlock(block, perRow, inversePerRow, count, firstMultiplier, 0, row, column);
  [[unroll]] for (uint k = 0; k < 4; ++k) {
    int r = int(k / 2), c = int(k % 2);
    load(k, row + 1 + r, column + 3 + c);
    load(4 + k, row + 3 + r, column + 1 + c);
  }
  correctShear(0, 1, 2, 3, 0);
  correctShear(4, 5, 6, 7, 2);
  [[unroll]] for (uint k = 0; k < 8; ++k) {
    store(k);
  }
}

// Whether a spring goes through the middle of the block, either way.
bool crosses(uint a, uint b) {
  return (a / 8 != b / 8) || (a % 4 / 2 != b % 4 / 2);
}

// Of insides all, of seams what crosses one.
void correctBlock(uint block, uint perRow, float inversePerRow, uint count, uint firstMultiplier,
                  bool seams) {
  int row, column;
  placeBlock(block, perRow, inversePerRow, count, firstMultiplier, seams ? 2 : 0, row, column);
  [[unroll]] for (uint k = 0; k < kSize * kSize; ++k) {
    load(k, row + int(k / kSize), column + int(k % kSize));
  }
  uint colour = 0;
  if (kBend) {
    [[unroll]] for (uint k = 0; k < 8; ++k) {
      uint a = k / 2 * kSize + k % 2;
      if (!seams || crosses(a, a + 2)) {
        correct(a, a + 2, cloth.bendRow, colour);
        ++colour;
      }
    }
    [[unroll]] for (uint a = 0; a < 8; ++a) {
      if (!seams || crosses(a, a + 2 * kSize)) {
        correct(a, a + 2 * kSize, cloth.bendColumn, colour);
        ++colour;
      }
    }
  }
  [[unroll]] for (uint k = 0; k < 9; ++k) {
    uint a = k / 3 * kSize + k % 3;
    if (!seams || crosses(a, a + kSize + 1)) {
      correctShear(a, a + 1, a + kSize, a + kSize + 1, colour);
      colour += 2;
    }
  }
  [[unroll]] for (uint k = 0; k < 12; ++k) {
    uint a = k / 3 * kSize + k % 3;
    if (!seams || crosses(a, a + 1)) {
      correct(a, a + 1, cloth.alongRow, colour);
      ++colour;
    }
  }
  [[unroll]] for (uint a = 0; a < 12; ++a) {
    if (!seams || crosses(a, a + kSize)) {
      correct(a, a + kSize, cloth.alongColumn, colour);
      ++colour;
    }
  }
  [[unroll]] for (uint k = 0; k < kSize * kSize; ++k) {
    store(k);
  }
}

// Rounds are as many for every invocation; the last one's surplus are of blocks beyond the grid.
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
      memoryBarrierBuffer();                                                            \
      barrier();                                                                        \
    }                                                                                   \
  }

void main() {
  vec4 tile = texelFetch(tiles, int(push.firstTile + gl_WorkGroupID.x));
  cloth = locateCloth(tile);
  float iterations = texelFetch(cloths, CLOTHSTREAM_CLOTH_TEXELS * int(tile.x) + CLOTHSTREAM_XPBD_TEXEL).w;
  uint endIteration = min(uint(iterations), push.endIteration);
  if (push.firstIteration >= endIteration) {
    return;
  }
  uint firstBlock = uint(tile.y);
  // Blocks in a row, and in all: without and with a shift.
  uint perRow = (uint(cloth.columns) + 3) / 4;
  uint count = perRow * ((uint(cloth.rows) + 3) / 4);
  uint shiftedPerRow = (uint(cloth.columns) + 5) / 4;
  uint shiftedCount = shiftedPerRow * ((uint(cloth.rows) + 5) / 4);
  float inversePerRow = reciprocal(float(perRow));
  float inverseShiftedPerRow = reciprocal(float(shiftedPerRow));
  uint seamMultipliers = cloth.firstMultiplier + kCornerColours * count;
  uint insideMultipliers = seamMultipliers + kSeamColours * shiftedCount;

  uint iteration = push.firstIteration;
  do {
    again = iteration > 0;
    if ((kPasses & kCorners) != 0) {
      PASS(correctCorners(block, perRow, inversePerRow, count, cloth.firstMultiplier), count)
    }
    if ((kPasses & kSeams) != 0) {
      PASS(correctBlock(block, shiftedPerRow, inverseShiftedPerRow, shiftedCount, seamMultipliers, true),
           shiftedCount)
    }
    if ((kPasses & kInsides) != 0) {
      PASS(correctBlock(block, perRow, inversePerRow, count, insideMultipliers, false), count)
    }
    ++iteration;
  } while (kWhole && iteration < endIteration);
}
