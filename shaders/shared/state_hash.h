// SPDX-License-Identifier: MIT
// The hash of a simulation state. It uses integer operations only, so that C++ and every device agree.
#ifndef CLOTHSTREAM_SHADERS_SHARED_STATE_HASH_H
#define CLOTHSTREAM_SHADERS_SHARED_STATE_HASH_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

struct NodeHash {
  uint32_t low;
  uint32_t high;
};

CLOTHSTREAM_SHARED_FUNCTION NodeHash absorbWord(NodeHash hash, uint32_t word) {
  hash.low = (hash.low ^ word) * 0x9E3779B1u;
  hash.low ^= hash.low >> 15;
  hash.high = (hash.high + word) * 0x85EBCA77u;
  hash.high ^= hash.high >> 13;
  return hash;
}

// Hash of one node from its index in the scene and the bits of its position and velocity. A state's hash is
// the sum of its nodes' hashes, each half modulo 2^32.
CLOTHSTREAM_SHARED_FUNCTION NodeHash hashNode(uint32_t index, uint32_t px, uint32_t py, uint32_t pz,
                                              uint32_t vx, uint32_t vy, uint32_t vz) {
  NodeHash hash;
  hash.low = 0x243F6A88u;  // the first digits of pi
  hash.high = 0x85A308D3u;
  hash = absorbWord(hash, index);
  hash = absorbWord(hash, px);
  hash = absorbWord(hash, py);
  hash = absorbWord(hash, pz);
  hash = absorbWord(hash, vx);
  hash = absorbWord(hash, vy);
  hash = absorbWord(hash, vz);
  // One more round spreads the last word over all bits.
  return absorbWord(hash, 0xC2B2AE3Du);
}

// True if a float with these bits is infinite, not a number, or further from zero than the float with the
// bits `limit`. Without the sign, the bits of floats have the order of their magnitudes, and non-finite
// floats come last.
CLOTHSTREAM_SHARED_FUNCTION bool isBeyond(uint32_t bits, uint32_t limit) {
  return (bits & 0x7FFFFFFFu) > limit;
}

// True if a float with these bits is infinite, not a number, or further than 8192 from zero.
CLOTHSTREAM_SHARED_FUNCTION bool isOutsideWorld(uint32_t bits) {
  return isBeyond(bits, 0x46000000u);
}

// A number whose order is that of the floats with these bits. Floats that are not numbers come first or last.
CLOTHSTREAM_SHARED_FUNCTION uint32_t orderOf(uint32_t bits) {
  return (bits & 0x80000000u) != 0u ? ~bits : bits | 0x80000000u;
}

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
// Bits of the float whose number is `order`.
inline uint32_t bitsInOrder(uint32_t order) {
  return (order & 0x80000000u) != 0u ? order & 0x7FFFFFFFu : ~order;
}
}  // namespace clothstream::shared
#endif

#endif
