// SPDX-License-Identifier: MIT
// Two directions along a surface and its normal, in integers alone.
#pragma once

#include <cstdint>

#include "proto/codec/hierarchical/lanes.h"

namespace clothstream::codec::hierarchical {

inline constexpr int kUnitBits = 14;  // a component of a unit vector is 2^kUnitBits at most

// Three orthogonal unit vectors u, v and n, to about 2^-13.
struct SurfaceFrame {
  Int16x8 tangents;  // ux uy uz 0 vx vy vz 0
  Int16x8 normal;    // nx ny nz 0 0 0 0 0

  // u a + v b + n c, of which the lanes are x, y, z: `along` has a b in all pairs, `across` c 0.
  Int32x4 combine(Int16x8 along, Int16x8 across) const {
    return dotPairs(interleaveHalves(tangents), along) +
           dotPairs(interleave(normal, Int16x8::zero()), across);
  }
  // The products with u, v and n of what has x y z 0 x y z 0, in units of 2^-kUnitBits; the fourth lane 0.
  Int32x4 project(Int16x8 vector) const {
    return addNeighbours(dotPairs(vector, tangents), dotPairs(vector, normal));
  }
};

// u along `first`, n across both; the axes x, y, z where the two span no plane. The fourth lanes are ignored.
SurfaceFrame surfaceFrame(Int32x4 first, Int32x4 second);

}  // namespace clothstream::codec::hierarchical
