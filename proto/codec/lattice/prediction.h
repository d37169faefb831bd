// SPDX-License-Identifier: MIT
// Integer prediction of one channel (x, y, z, or an octahedral component) from neighbours and the reference
// frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "proto/codec/stream_layout.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec {

// What is predicted is d = value, or in the temporal ones d = value - reference. W is the vertex before in
// the row, N the one above, NW the one before that; without N only W is used and without W only N, in all but
// `temporal`.
enum class Prediction : std::uint8_t {
  average = 0,          // d is about (dW + dN) >> 1
  planar = 1,           // d is about dW + dN - dNW: Lorenzo
  temporal = 2,         // value is about the reference
  temporalAverage = 3,  // average, of the change since the reference
  temporalPlanar = 4,   // planar, of the change since the reference
};
inline constexpr std::size_t kPredictionCount = 5;

constexpr bool needsReference(Prediction prediction) {
  return prediction >= Prediction::temporal;
}

// T is int32_t for lattice coordinates and int8_t for octahedral components; all arithmetic is modulo its
// width, so that any residuals have a defined result. A cloth that is no grid is one row. Channels are arrays
// over all vertices.

// Residuals of one channel. `reference` may be null where the prediction needs none.
template <typename T>
void predict(const StreamLayout& layout, Prediction prediction, const T* values, const T* reference,
             T* residuals);

// The inverse; `residuals` and `values` may be the same array.
template <typename T>
void reconstruct(const StreamLayout& layout, Prediction prediction, const T* residuals, const T* reference,
                 T* values);

// Bits that the residuals of a sample (every kCostStride-th vertex) have, for each prediction; those that
// need a reference are left at the largest number where it is null. Adds to `costs`.
using PredictionCosts = std::array<std::uint32_t, kPredictionCount>;
inline constexpr std::uint32_t kCostStride = 4;
template <typename T>
void measure(const StreamLayout& layout, const T* values, const T* reference, PredictionCosts& costs);

// The first of the cheapest among those that a frame of this kind may use.
Prediction cheapest(std::span<const std::uint32_t, kPredictionCount> costs, bool hasReference);

}  // namespace clothstream::codec
