// SPDX-License-Identifier: MIT
// Constants and push constants of codec 2 that the kernels and the CPU share. C++ and GLSL use the same
// layout.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_HIERARCHICAL_H
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_HIERARCHICAL_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Tables and moments have rows of uvec4, one per slot (proto/codec/hierarchical/hierarchy.h). The loads of
// consecutive slots in a row are consecutive in memory.
const uint32_t kLinkParents = 0;
const uint32_t kLinkRing = 1;  // this row and the next one
const uint32_t kLinkNearest = 3;
const uint32_t kLinkRows = 4;

// The slot table has two rows of words: the slot's vertex, then the weights of its parents except the first,
// ten bits each.
const uint32_t kEqualParentWeights = 0x01004010u;

// A moment has one node per vertex, then the origin, then these rows. Three words are two vectors of 16-bit
// components, as in Record (proto/codec/hierarchical/predictor.h). The first vector is in the low halves.
const uint32_t kRowAverage = 0;       // 32-bit components; T0 - T1 (x y)
const uint32_t kRowDetail = 1;        // E and G; T0 - T1 (z)
const uint32_t kRowChange = 2;        // change of these two since the frame before
const uint32_t kRowChangeBefore = 3;  // the same of the frame before
const uint32_t kRowTwist = 4;         // Q and T
const uint32_t kRowLocal = 5;         // D, and that of the frame before
const uint32_t kRowCurvature = 6;     // C, and that of the frame before; sums of magnitudes
const uint32_t kRecordRows = 7;

const uint32_t kClasses = 6;  // classes with weights
const uint32_t kClassFeatures = 16;
const uint32_t kClassWeights = 96;  // of all classes
const uint32_t kFeatureProducts = 152;
const uint32_t kChunkSlots = 64;
const uint32_t kMaxMagnitude = 31;
const uint32_t kMaxStillFrames = 3;
const uint32_t kRestsInTurn = 64;

struct PredictPush {
  uint32_t vertexCount;
  uint32_t sinceKey;  // frames since the key frame; 0: a key frame
  uint32_t stepBits;
  uint32_t hasWeights;  // 1: the frame has weights, unless all vertices are at rest
  // Units are metres times `scale` / 2^`scaleShift` (quantisationScale()).
  uint32_t scale;
  uint32_t scaleShift;
  uint32_t firstPhase;
  uint32_t endPhase;
};

// Results that a frame's kernels add up by integer atomics, whose order does not matter. Zero before the
// first kernel.
struct SlotStatus {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t moved;  // 1: at least one vertex has to move
  uint32_t restWishes;
};

// First indices of the weights: those that the reference left, those that the frame brings for itself, and
// those for the frames that refer to it.
const uint32_t kKeptWeights = 0;
const uint32_t kSentWeights = 96;
const uint32_t kLeftWeights = 192;
const uint32_t kAllWeights = 288;

// The readback has two words per vertex, in two rows. The first has the residuals along u and v, 16 bits
// each. The second has the residual along n, then three scales of five bits for u, v and n.
const uint32_t kResidualRows = 2;
// Flag in the second word. With residuals of 0 the vertex stays. Otherwise its residuals need more than 16
// bits and are in another table, three words per slot.
const uint32_t kSpecialWord = 0x80000000u;

// Fourth corner of a triangle.
const uint32_t kNoCorner = 0xFFFFFFFFu;

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(PredictPush) == 32 && sizeof(SlotStatus) == 16);
}  // namespace clothstream::shared
#endif

#endif
