// SPDX-License-Identifier: MIT
// Model of residuals: their expected magnitude, and the distribution that follows from it.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "proto/codec/hierarchical/predictor.h"
#include "proto/codec/hierarchical/simd.h"

namespace clothstream::codec::hierarchical {

enum Component : std::uint8_t { kAlongU, kAlongV, kAlongNormal };
inline constexpr std::size_t kComponents = 3;
inline constexpr std::array<Component, kComponents> kCodingOrder{kAlongNormal, kAlongU, kAlongV};

// Weights of the terms whose sum is the expected magnitude of a component, in 1/256 of a step.
struct ScaleWeights {
  std::int16_t parents, ring, last;  // multiply this component's byte of the Prediction's sums of magnitudes
  std::int16_t normal, u;            // multiply the magnitudes of this vertex that are already known
  std::int16_t constant;
};
// Each class covers two weight classes; the fourth is that of the corners. The second half is for key frames,
// which have no previous frame.
inline constexpr std::size_t kScaleClasses = 8;
constexpr std::size_t scaleClassOf(std::uint32_t weightClass, bool key) {
  return weightClass / 2 + (key ? kScaleClasses / 2 : 0);
}
extern const std::array<std::array<ScaleWeights, kComponents>, kScaleClasses> kScaleWeights;

// Frequencies of symbols, which add up to 2^kProbabilityBits. The last symbol is the escape.
inline constexpr int kProbabilityBits = 12;
inline constexpr std::size_t kSymbols = 16;
inline constexpr std::uint32_t kEscape = kSymbols - 1;
using Distribution = std::array<std::int16_t, kSymbols>;
inline constexpr std::size_t kScales = 24;  // scales of expected magnitudes, two for each octave
extern const std::array<Distribution, 2 * kScales> kDistributions;

// Distributions along the surface come first.
constexpr std::size_t distributionOf(Component component, std::uint32_t scale) {
  return (component == kAlongNormal ? kScales : 0) + scale;
}

// Scale of an expected magnitude: its octave, and the half of the octave.
constexpr std::uint32_t scaleOf(std::int32_t expected) {
  const auto e = static_cast<std::uint32_t>(std::clamp(expected, 4, 16383));
  const auto octave = static_cast<std::uint32_t>(std::bit_width(e)) - 1;
  return 2 * (octave - 2) + (e >> (octave - 1) & 1u);
}

// Number of low bits of a residual's number that are written next to its symbol.
inline constexpr std::uint32_t kFirstScaleWithRawBits = 16;
constexpr unsigned rawBits(std::uint32_t scale) {
  return scale < kFirstScaleWithRawBits ? 0 : (scale + 2 - kFirstScaleWithRawBits) / 2;
}

// Scales of four expected magnitudes.
inline Int32x4 scalesOf(Int32x4 expected) {
  // They are the exponent of a float and the bit below it.
  const Float32x4 e = clamp(Float32x4::of(expected), 4, 16383);
  return e.bits().bitsShiftedRight(22) - Int32x4::all(2 * (127 + 2));
}

// Weights of a scale class, as vectors.
class ScaleModel {
 public:
  explicit ScaleModel(const std::array<ScaleWeights, kComponents>& w)
      : near_(Int16x8::of(w[0].parents, w[0].ring, w[1].parents, w[1].ring, w[2].parents, w[2].ring)),
        past_(Int16x8::of(w[0].last, w[0].constant, w[1].last, w[1].constant, w[2].last, w[2].constant)),
        own_{Int16x8::allPairs(w[0].normal, 0), Int16x8::allPairs(w[1].normal, w[1].u), Int16x8::zero()} {}

  // Expected magnitudes of four vertices along u, v and n, before their own residuals are known.
  Vectors4 expect(const Prediction* four) const {
    std::array<Int32x4, 4> expected;
    for (std::size_t i = 0; i < 4; ++i) {
      const Prediction& p = four[i];
      const Int16x8 near = interleave(widenBytes(p.parentMagnitudes), widenBytes(p.ringMagnitudes));
      const Int16x8 past = interleave(widenBytes(p.lastMagnitudes), Int16x8::all(1));
      expected[i] = dotPairs(near, near_) + dotPairs(past, past_);
    }
    return transposed(expected);
  }

  // Ignores the magnitudes of components that come later in kCodingOrder.
  Int32x4 scales(Component component, Int32x4 expected, Int32x4 normalMagnitudes, Int32x4 uMagnitudes) const {
    return scalesOf(expected + dotPairs(pairs(normalMagnitudes, uMagnitudes), own_[component]));
  }

 private:
  Int16x8 near_, past_;
  std::array<Int16x8, kComponents> own_;
};

// Magnitudes of residuals as a Node counts them.
inline Int32x4 countedMagnitudes(Int32x4 residuals) {
  const Int32x4 m = residuals.magnitude(), most = Int32x4::all(kMaxMagnitude);
  return select(m.bitsShiftedRight(5) == Int32x4::all(0), m, most);
}
// Packs magnitudes along u, v and n as in a Node.
inline Int32x4 packMagnitudes(Int32x4 u, Int32x4 v, Int32x4 n) {
  return u | v.shiftedLeft(8) | n.shiftedLeft(16);
}

}  // namespace clothstream::codec::hierarchical
