// SPDX-License-Identifier: MIT
// Tables of the kernels of the coarse correction. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_COARSE_COARSE_H
#define CLOTHSTREAM_SHADERS_COARSE_COARSE_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"
#include "shaders/shared/whole_number.h"

CLOTHSTREAM_SHARED_BEGIN

// Maximum number of coarse nodes of a cloth: model::kMaxCoarseNodes.
#define CLOTHSTREAM_COARSE_NODES 289

// Nodes whose weighted mean is a coarse node. A movable coarse node of a grid has no list.
struct CoarseNodeRecord {
  float firstLow;  // texels of two CoarseShare: wholeNumber(low, high)
  float firstHigh;
  float count;      // texels
  float isMovable;  // 0: the coarse node is fixed
};

// A node of the scene in the mean of a coarse node, or a coarse node of the cloth that moves a node.
struct CoarseShare {
  float node;
  float weight;
};

// Two coarse nodes of the cloth and their largest distance, m. The first one takes a part of a correction,
// and the second one the rest.
struct CoarseLinkRecord {
  float a;
  float b;
  float longest;
  float partOfA;
};

struct CoarsePush {
  uint32_t firstNode;  // of the cloth, in the scene
  uint32_t nodeCount;
  uint32_t firstCoarse;  // coarse node of the cloth, in the scene
  uint32_t coarseCount;
  uint32_t firstPart;  // of the cloth's partial sums
  uint32_t firstColour;
  uint32_t colourCount;
  uint32_t sweeps;
  float velocityRate;  // inverse of the time since the last correction, 1/s
  float thickness;     // m, of the cloth
  // Used for meshes.
  uint32_t firstShare;  // of the cloth's nodes; two texels each
  uint32_t parts;       // partial sums of a mean
  // Used for grids.
  uint32_t rows;  // 0: the cloth is a mesh
  uint32_t columns;
  uint32_t coarseRows;
  uint32_t coarseColumns;
  uint32_t stride;  // rows and columns between coarse nodes
  float inverseStride;
  float inverseLastRows;  // of the number of rows between the last two coarse rows
  float inverseLastColumns;
  CollisionPush collision;  // of a substep in which no collider moves
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(CoarseNodeRecord) == 16 && sizeof(CoarseShare) == 8 && sizeof(CoarseLinkRecord) == 16 &&
              sizeof(CoarsePush) == 112);
}  // namespace clothstream::shared
#else

CoarseNodeRecord coarseNodeAt(samplerBuffer table, uint number) {
  vec4 texel = texelFetch(table, int(number));
  return CoarseNodeRecord(CLOTHSTREAM_FLOATS(texel));
}

// Row or column of a coarse row or column: every stride-th one, and the last of `count`.
uint coarsePlace(uint coarse, uint stride, uint count) {
  return min(coarse * stride, count - 1);
}

// Rows or columns with a weight in the mean of coarse row or column `coarse`. The weights fall to 0 at its
// neighbours. The last cell may be shorter than the others.
struct CoarseHat {
  uint centre;
  uint first;
  uint last;
  float before;  // fall of the weight from one row or column to the next
  float after;
};

CoarseHat coarseHat(uint coarse, uint coarseCount, uint stride, uint count, float inverseStride,
                    float inverseLast) {
  uint centre = coarsePlace(coarse, stride, count);
  bool isLast = coarse + 1 == coarseCount;
  uint first = coarse == 0 ? centre : (coarse - 1) * stride + 1;
  uint last = isLast ? centre : coarsePlace(coarse + 1, stride, count) - 1;
  return CoarseHat(centre, first, last, isLast ? inverseLast : inverseStride,
                   coarse + 2 == coarseCount ? inverseLast : inverseStride);
}

float coarseWeight(CoarseHat hat, uint place) {
  precise float weight = place < hat.centre ? 1.0 - float(hat.centre - place) * hat.before
                                            : 1.0 - float(place - hat.centre) * hat.after;
  return weight;
}

CoarseLinkRecord coarseLinkAt(samplerBuffer table, int number) {
  vec4 texel = texelFetch(table, number);
  return CoarseLinkRecord(CLOTHSTREAM_FLOATS(texel));
}

#endif

#endif
