// SPDX-License-Identifier: MIT
// Definitions that encoder and decoder of codec 2 share, apart from the prediction.
#pragma once

#include <array>
#include <cstddef>

#include "proto/codec/hierarchical/normal_prediction.h"
#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

// Positions are multiples of `unit`. Residuals are steps of 2^stepBits units.
struct LatticeUnit {
  int stepBits;
  float unit;  // metres
};
// Chooses the unit so that half a step and two units, which cover all roundings, are 2^-19 m below the max
// error. That margin is the rounding of decoded floats at 32 m. Takes as many stepBits as this leaves room
// for.
LatticeUnit latticeUnit(float maxError);
// Largest magnitude of a wanted coordinate in units. The residual ends within a step of it and must stay
// within kMaxCoordinate.
inline constexpr std::int32_t kMaxWanted = kMaxCoordinate - (4 << 8);
// Units of a max error, less 2^-19 m, with 8 step bits.
inline constexpr int kUnitsInMaxError = (1 << 7) + 2;

// Factor from metres to units, which are rounded to nearest even. It is 1 / unit to so few bits that its
// product with a float32 is exact in a float64 and in integers. Its error is at most an eighth of a unit; the
// constant of two units above leaves half a unit for it.
inline constexpr int kScaleBits = 29;
double quantisationScale(float unit);

// An encoder lets a vertex rest that has been wanted in the same place for kStillFrames frames. At most about
// kRestsAtOnce vertices start to rest in a frame; if there are more, they alternate.
inline constexpr std::uint8_t kStillFrames = 3;
inline constexpr std::uint32_t kRestsAtOnce = 64;

// Sections of a packet of codec 2: changes of the weights (may be empty), symbols, and bits. Symbols and bits
// have two sections each: first those of the coarse vertices, up to the byte or word that they end in, then
// the rest.
inline constexpr std::size_t kSections = 5;
enum Section : std::uint8_t { kWeightChanges, kCoarseSymbols, kFineSymbols, kCoarseBits, kFineBits };
inline constexpr unsigned kWeightGammaBits = 4, kEscapeGammaBits = 2;
// Value of the first number beyond the symbols. Along the normal it is no residual: the vertex is where it
// was in the previous frame and has no other residuals.
inline constexpr std::uint32_t kStays = 0;

// A first section that is not empty starts with a bit. If it is 1, nothing follows and all weights are 0 in
// this frame alone, so that resting cloth stays where it is. If it is 0, changes follow.

// Weights that the changes of a key frame apply to, and weights that a key frame leaves. Any other frame
// starts with the weights that its reference left, and leaves them with its changes.
Weights keyFrameWeights();
Weights startingWeights();

std::array<WeightVectors, kWeightClasses + 1> weightVectors(const Weights& weights);

// Range of features whose weights a frame of this kind can change.
constexpr std::size_t firstWeight(bool key) {
  return key ? kTwistFeature : 0;
}
constexpr std::size_t endWeight(bool key) {
  return key ? kRingFeature + 1 : kFeatures;
}

// Hash of the newest frame, in the layout's order of vertices. `normals` are by vertex, or empty.
std::uint64_t hashNodes(const Predictor& predictor, std::span<const FacedNormal> normals);

}  // namespace clothstream::codec::hierarchical
