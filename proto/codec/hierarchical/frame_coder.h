// SPDX-License-Identifier: MIT
// What encoder and decoder of codec 2 agree on beside the prediction.
#pragma once

#include <array>
#include <cstddef>

#include "proto/codec/hierarchical/normal_prediction.h"
#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

// Positions are multiples of `unit`; residuals are steps of 2^stepBits units.
struct LatticeUnit {
  int stepBits;
  float unit;  // m
};
// Half a step and two units, which all roundings take together, are 2^-19 m less than the max error: as much
// as the floats that a decoder gives are off at 32 m. As many stepBits as leave room for that.
LatticeUnit latticeUnit(float maxError);

// What an encoder multiplies metres by, to round to the nearest unit and the even one of two: 1 / unit to so
// few bits that the product with a float32 is exact in a float64, or in integers. It is off by an eighth of a
// unit at most, where the constant two units above have half a one to spare.
inline constexpr int kScaleBits = 29;
double quantisationScale(float unit);

// An encoder lets a vertex rest that is wanted in the same place for so many frames; about so many start to
// in a frame: in turns, where there are more.
inline constexpr std::uint8_t kStillFrames = 3;
inline constexpr std::uint32_t kRestsAtOnce = 64;

// The sections of a packet of codec 2: changes of the weights (empty where there are none), symbols, bits
// beside them; of the latter two first what the coarse vertices take, to the byte or word that they end in,
// then the rest.
inline constexpr std::size_t kSections = 5;
enum Section : std::uint8_t { kWeightChanges, kCoarseSymbols, kFineSymbols, kCoarseBits, kFineBits };
// Of codec 3: the same changes, the groups of the coarse vertices (packed_blocks.h), those of the others.
inline constexpr std::size_t kPackedSections = 3;
enum PackedSection : std::uint8_t { kPackedWeightChanges, kCoarseGroups, kFineGroups };
inline constexpr unsigned kWeightGammaBits = 4, kEscapeGammaBits = 2;
// Stands for the first number beyond the symbols. Along the normal it is no residual: the vertex is where it
// was in the frame before, and has no other residuals.
inline constexpr std::uint32_t kStays = 0;

// The first section, where it is not empty, starts with a bit: 1 where nothing follows and all weights are 0
// in this frame alone, so that what is at rest stays where it is; else changes follow, by layer.

// What a key frame's changes apply to; what it leaves, for every layer.
Weights keyFrameWeights();
Weights startingWeights();

// By layer. A frame starts with those that its reference left, changes those of its own layer and of higher
// ones, and leaves them to the frames that refer to it.
using LayerWeights = std::array<Weights, kMaxTemporalLayers>;

std::array<WeightVectors, kWeightClasses + 1> weightVectors(const Weights& weights);

// The features whose weights a frame of this kind can change.
constexpr std::size_t firstWeight(bool key) {
  return key ? kTwistFeature : 0;
}
constexpr std::size_t endWeight(bool key) {
  return key ? kRingFeature + 1 : kFeatures;
}

// Of the newest frame; in the layout's order of vertices. `normals` by vertex, or none.
std::uint64_t hashNodes(const Predictor& predictor, std::span<const FacedNormal> normals);

}  // namespace clothstream::codec::hierarchical
