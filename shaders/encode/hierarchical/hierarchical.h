// SPDX-License-Identifier: MIT
// What the kernels of codec 2 and the CPU share, laid out alike in C++ and in GLSL's std430.
#ifndef CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_HIERARCHICAL_H
#define CLOTHSTREAM_SHADERS_ENCODE_HIERARCHICAL_HIERARCHICAL_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// Tables and moments are rows of uvec4, one a slot (proto/codec/hierarchical/hierarchy.h): what a row's
// neighbours load lies beside each other.
const uint32_t kLinkParents = 0;
const uint32_t kLinkRing = 1;  // and the row after it
const uint32_t kLinkNearest = 3;
const uint32_t kLinkRows = 4;

// Beside them stand two words a slot, in two rows: its vertex, and the weights of its parents but the first,
// ten bits each.
const uint32_t kEqualParentWeights = 0x01004010u;

// A moment has a node more than vertices, the origin, then these rows. Three words are two vectors of 16-bit
// components, as in Record (proto/codec/hierarchical/predictor.h): the first in the low halves.
const uint32_t kRowAverage = 0;       // 32-bit components; W0 - W1 (x y)
const uint32_t kRowDetail = 1;        // E and G; W0 - W1 (z)
const uint32_t kRowChange = 2;        // of these two since the frame before
const uint32_t kRowChangeBefore = 3;  // the same of the frame before
const uint32_t kRowTwist = 4;         // Q and W
const uint32_t kRowLocal = 5;         // D, and that of the frame before
const uint32_t kRowCurvature = 6;     // C, and that of the frame before; sums of magnitudes
const uint32_t kRecordRows = 7;

const uint32_t kClasses = 6;  // that have weights
const uint32_t kClassFeatures = 16;
const uint32_t kClassWeights = 96;  // of all classes
const uint32_t kFeatureProducts = 152;
const uint32_t kChunkSlots = 64;
const uint32_t kMostMagnitude = 31;
const uint32_t kMostStillFrames = 3;
const uint32_t kRestsInTurn = 64;

struct PredictPush {
  uint32_t vertexCount;
  uint32_t sinceKey;  // frames; 0: a key frame
  uint32_t stepBits;
  uint32_t hasWeights;  // 1: the frame brings weights, unless all is at rest
  // Units are metres times `scale` / 2^`scaleShift` (quantisationScale()).
  uint32_t scale;
  uint32_t scaleShift;
  uint32_t firstPhase;
  uint32_t endPhase;
};

// What a frame's kernels gather by integer atomics, whose order does not matter. Zero before the first
// kernel.
struct SlotStatus {
  uint32_t hashLow;
  uint32_t hashHigh;
  uint32_t moved;  // 1: somewhere the reference does not serve once more
  uint32_t restWishes;
};

// What weights there are: those that the reference left; those that the frame brings for itself, and for the
// frames that refer to it.
const uint32_t kKeptWeights = 0;
const uint32_t kSentWeights = 96;
const uint32_t kLeftWeights = 192;
const uint32_t kAllWeights = 288;

// What is read back of a vertex are two words, in two rows: the residuals along u and v, 16 bits each; that
// along n, then three scales of five bits, of u, v and n.
const uint32_t kResidualRows = 2;
// In the second: the vertex stays, where its residuals are 0; else they need more than 16 bits and stand,
// three words a slot, elsewhere.
const uint32_t kSpecialWord = 0x80000000u;

// In place of a triangle's fourth corner.
const uint32_t kNoCorner = 0xFFFFFFFFu;

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(PredictPush) == 32 && sizeof(SlotStatus) == 16);
}  // namespace clothstream::shared
#endif

#endif
