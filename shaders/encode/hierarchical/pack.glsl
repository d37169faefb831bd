// SPDX-License-Identifier: MIT
// Packs groups of numbers, as in proto/codec/hierarchical/packed_blocks.cpp. A workgroup writes a group, and
// each of its invocations a block.
//
// The including kernel defines PACKED_COMPONENTS and PACKED_WORDS per vertex, and the functions that are only
// declared here.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PACK_GLSL
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_PACK_GLSL

#include "shaders/encode/hierarchical/hierarchical.h"

layout(local_size_x_id = 0) in;

layout(push_constant) uniform Push {
  PackPush push;
};
layout(std430, binding = 0) coherent buffer Scratch {
  uint scratch[];
};
layout(std430, binding = 1) writeonly buffer Words {
  uint words[];
};
layout(std430, binding = 2) writeonly buffer Sizes {
  uint sizes[];  // by group, in bytes
};

const uint kBlocks = kPackedGroup / kPackedBlock;
const uint kRuns = 1;
const uint kFirstPlain = 2;
const uint kRunVertices = 4;
const uint kEscape = 15;
const uint kStayNumber = 0xFFFFFFFFu;

// First vertex and end of a group.
uvec2 verticesOf(uint group);
// A number in zigzag form; kStayNumber along the normal if the vertex stays.
uint numberOf(uint vertex, uint component);

shared uint modesOf[kBlocks];
shared uint bitsOf[kBlocks];
shared uint anyMode;

uint zigzag(int value) {
  return uint(value << 1) ^ uint(value >> 31);
}

// Number of escape numbers with a special meaning.
uint reservedOf(uint component) {
  return PACKED_COMPONENTS == 3 && component == 0 ? 1 : 0;
}

uint gammaBits(uint value) {
  return 2 * uint(findMSB(value + 4)) - 1;
}

uint numberBits(uint number, uint low, uint reserved) {
  if (number == kStayNumber) {
    return kEscape + gammaBits(0);
  }
  uint ones = number >> low;
  return low + (ones < kEscape ? ones + 1 : kEscape + gammaBits(ones - kEscape + reserved));
}

uint blockBits(uvec2 block, uint component, uint mode) {
  bool isRuns = mode == kRuns;
  uint low = isRuns ? 0 : mode - kFirstPlain;
  uint bits = 0;
  for (uint first = block.x; first < block.y; first += kRunVertices) {
    uint all = 0, some = 0;
    for (uint v = first; v < min(first + kRunVertices, block.y); ++v) {
      uint number = numberOf(v, component);
      some |= number;
      all += numberBits(number, low, reservedOf(component));
    }
    bits += isRuns ? 1 + (some == 0 ? 0 : all) : all;
  }
  return bits;
}

bool isZero(uvec2 vertices, uint component) {
  uint some = 0;
  for (uint v = vertices.x; v < vertices.y; ++v) {
    some |= numberOf(v, component);
  }
  return some == 0;
}

// Best mode of a component of the block, and the number of bits it takes.
uvec2 choose(uvec2 block, uint component) {
  if (isZero(block, component)) {
    return uvec2(0);
  }
  uvec2 best = uvec2(kRuns, blockBits(block, component, kRuns));
  while (best.x + 1 < kPackedModes) {
    uint next = blockBits(block, component, best.x + 1);
    if (next >= best.y) {
      break;
    }
    best = uvec2(best.x + 1, next);
  }
  return best;
}

// Index of the next bit in the scratch memory, and the pending bits of its word.
uint at;
uint pending;

void put(uint value, uint bits) {
  uint shift = at & 31u;
  pending |= value << shift;
  if (shift + bits >= 32) {
    atomicOr(scratch[at >> 5], pending);
    pending = shift == 0 ? 0 : value >> (32 - shift);
  }
  at += bits;
}

void putNumber(uint number, uint low, uint reserved) {
  bool stays = number == kStayNumber;
  uint ones = number >> low;
  if (!stays && ones < kEscape) {
    put((1u << ones) - 1, ones + 1);
  } else {
    put((1u << kEscape) - 1, kEscape);
    uint shifted = (stays ? 0 : ones - kEscape + reserved) + 4;
    uint width = uint(findMSB(shifted));
    put(0, width - 2);
    put(1, 1);
    put(shifted - (1u << width), width);
  }
  if (!stays) {
    put(bitfieldExtract(number, 0, int(low)), low);
  }
}

void putBlock(uvec2 block, uint component, uint mode) {
  uint low = mode == kRuns ? 0 : mode - kFirstPlain;
  for (uint first = block.x; first < block.y; first += kRunVertices) {
    uvec2 run = uvec2(first, min(first + kRunVertices, block.y));
    bool isSkipped = mode == kRuns && isZero(run, component);
    if (mode == kRuns) {
      put(isSkipped ? 1 : 0, 1);
    }
    for (uint v = run.x; !isSkipped && v < run.y; ++v) {
      putNumber(numberOf(v, component), low, reservedOf(component));
    }
  }
}

// Difference between a mode and that of the block before.
uint modeNumber(uint mode, uint before, uint component) {
  return zigzag(int(mode) - int(bitfieldExtract(before, int(8 * component), 8)));
}

// Writes cannot race: a workgroup has its own words, and its invocations set different bits.
void main() {
  uint group = gl_WorkGroupID.x, place = gl_LocalInvocationIndex;
  uvec2 vertices = verticesOf(group);
  uint first = min(vertices.x + place * kPackedBlock, vertices.y);
  uvec2 block = uvec2(first, min(first + kPackedBlock, vertices.y));
  if (place == 0) {
    anyMode = 0;
  }
  uvec2 chosen[PACKED_COMPONENTS];
  uint modes = 0;
  for (uint c = 0; c < PACKED_COMPONENTS; ++c) {
    chosen[c] = choose(block, c);
    modes |= chosen[c].x << (8 * c);
  }
  modesOf[place] = modes;
  barrier();
  atomicOr(anyMode, modes);
  uint before = place == 0 ? 0 : modesOf[place - 1];
  uint bits = 0;
  for (uint c = 0; c < PACKED_COMPONENTS; ++c) {
    bits += chosen[c].y + numberBits(modeNumber(chosen[c].x, before, c), 0, 0);
  }
  bitsOf[place] = block.x < block.y ? bits : 0;
  barrier();
  bool isQuiet = anyMode == 0;
  uint start = 1, all = 1;
  for (uint i = 0; i < kBlocks; ++i) {
    start += i < place ? bitsOf[i] : 0;
    all += isQuiet ? 0 : bitsOf[i];
  }
  uint from = vertices.x * PACKED_WORDS + group * kPackedExtraWords, count = (all + 31) / 32;
  for (uint i = place; i < count; i += kBlocks) {
    scratch[from + i] = 0;
  }
  memoryBarrierBuffer();
  barrier();
  at = 32 * from + (place == 0 ? 0 : start);
  pending = 0;
  if (place == 0) {
    put(isQuiet ? 1 : 0, 1);
  }
  for (uint c = 0; c < PACKED_COMPONENTS && !isQuiet && block.x < block.y; ++c) {
    putNumber(modeNumber(chosen[c].x, before, c), 0, 0);
    if (chosen[c].x != 0) {
      putBlock(block, c, chosen[c].x);
    }
  }
  if (pending != 0) {
    atomicOr(scratch[at >> 5], pending);
  }
  memoryBarrierBuffer();
  barrier();
  for (uint i = place; i < count; i += kBlocks) {
    words[from + i] = scratch[from + i];
  }
  if (place == 0) {
    sizes[group] = (all + 7) / 8;
  }
}

#endif
