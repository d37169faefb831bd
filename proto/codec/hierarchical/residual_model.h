// SPDX-License-Identifier: MIT
// How large a residual is expected to be, and how its values are then distributed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "proto/codec/hierarchical/lanes.h"
#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

enum Component : std::uint8_t { kAlongU, kAlongV, kAlongNormal };
inline constexpr std::size_t kComponents = 3;
inline constexpr std::array<Component, kComponents> kCodingOrder{kAlongNormal, kAlongU, kAlongV};

// The expected magnitude of a component, in 1/256 of a step, is the sum of these.
struct ScaleWeights {
  std::int16_t parents, ring, last;  // times that component's byte of a Prediction's sums of magnitudes
  std::int16_t normal, u;            // times the magnitudes of this vertex that are known by then
  std::int16_t constant;
};
inline constexpr std::size_t kScaleClasses = 4;  // two weight classes each; the last is the corners'
extern const std::array<std::array<ScaleWeights, kComponents>, kScaleClasses> kScaleWeights;

// Frequencies of symbols, of 2^kProbabilityBits; the last symbol is the escape.
inline constexpr int kProbabilityBits = 12;
inline constexpr std::size_t kSymbols = 16;
inline constexpr std::uint32_t kEscape = kSymbols - 1;
using Distribution = std::array<std::int16_t, kSymbols>;
inline constexpr std::size_t kScales = 24;  // of expected magnitudes, two an octave
extern const std::array<Distribution, 2 * kScales> kDistributions;

// Those along the surface come first.
constexpr std::size_t distributionOf(Component component, std::uint32_t scale) {
  return (component == kAlongNormal ? kScales : 0) + scale;
}

// From the second bit of the expected magnitude up: its octave, and which half of it.
constexpr std::uint32_t scaleOf(std::int32_t expected) {
  const auto e = static_cast<std::uint32_t>(std::clamp(expected, 4, 16383));
  const auto octave = static_cast<std::uint32_t>(std::bit_width(e)) - 1;
  return 2 * (octave - 2) + (e >> (octave - 1) & 1u);
}

// How many of the lowest bits of a residual's number stand beside its symbol.
constexpr unsigned rawBits(std::uint32_t scale) {
  return scale < 16 ? 0 : (scale - 14) / 2;
}

// A scale class's weights as vectors.
class ScaleModel {
 public:
  explicit ScaleModel(const std::array<ScaleWeights, kComponents>& w)
      : near_(Int16x8::of(w[0].parents, w[0].ring, w[1].parents, w[1].ring, w[2].parents, w[2].ring)),
        past_(Int16x8::of(w[0].last, w[0].constant, w[1].last, w[1].constant, w[2].last, w[2].constant)),
        weights_(&w) {}

  // What is expected before the vertex's own residuals are known, by component.
  Int32x4 expect(const Prediction& p) const {
    const Int16x8 near = interleave(widenBytes(p.parentMagnitudes), widenBytes(p.ringMagnitudes));
    const Int16x8 past = interleave(widenBytes(p.lastMagnitudes), Int16x8::all(1));
    return dotPairs(near, near_) + dotPairs(past, past_);
  }

  // `magnitudes` of the components that come before it in kCodingOrder.
  std::uint32_t scale(Component component, std::int32_t expected, const std::uint32_t* magnitudes) const {
    const ScaleWeights& w = (*weights_)[component];
    if (component != kAlongNormal) expected += w.normal * static_cast<std::int32_t>(magnitudes[kAlongNormal]);
    if (component == kAlongV) expected += w.u * static_cast<std::int32_t>(magnitudes[kAlongU]);
    return scaleOf(expected);
  }

 private:
  Int16x8 near_, past_;
  const std::array<ScaleWeights, kComponents>* weights_;
};

// As it counts in a Node.
constexpr std::uint32_t countedMagnitude(std::int32_t residual) {
  const auto bits = static_cast<std::uint32_t>(residual);
  return std::min(residual < 0 ? 0u - bits : bits, kMaxMagnitude);
}
constexpr std::uint32_t packMagnitudes(const std::uint32_t* m) {
  return m[kAlongU] | m[kAlongV] << 8 | m[kAlongNormal] << 16;
}

}  // namespace clothstream::codec::hierarchical
