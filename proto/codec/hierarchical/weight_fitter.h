// SPDX-License-Identifier: MIT
// The weights that would have predicted the last frames best, by least squares. The encoder's own business:
// floating point serves.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

// What a chunk says about its class's weights: the sums over some vertices of feature i times feature j, j
// from i up, then of feature i times the goal; for each i one after the other. Floats, in an order that does
// not depend on how many work on it: by x, y and z over the vertices, then over these.
inline constexpr std::size_t kProducts = kFeatures * (kFeatures + 1) / 2 + kFeatures;
using ChunkProducts = std::array<float, kProducts>;

// Those of the chunk that is being coded.
class ProductSums {
 public:
  // `goal`: what the weighted features should have added up to, in sixteenths of a step. The fourth lanes are
  // ignored.
  void add(const FeatureVectors& features, Int32x4 goal, float importance);
  // What was added since the last call.
  const ChunkProducts& take();

 private:
  alignas(16) std::array<std::array<float, 4>, kProducts> byAxis_{};
  ChunkProducts sums_{};
};

// 1 / x, less up to an eighth: the same on every machine, which a quotient is not.
inline float roughReciprocal(std::uint32_t x) {
  return std::bit_cast<float>(0x7ef311c3u - std::bit_cast<std::uint32_t>(static_cast<float>(x)));
}

class WeightFitter {
 public:
  void add(std::size_t weightClass, const ChunkProducts& products);

  // To all that was added, the older the less; stays near `weights` where that says little, and nearer in a
  // key frame, of which there is one alone.
  void fit(Weights& weights, bool key);

  void clear() { classes_ = {}; }

 private:
  struct Sums {
    std::array<double, kProducts> fresh{}, all{};  // since the last fit; those before it too
  };

  std::array<Sums, kWeightClasses> classes_{};
};

// Which chunks are fitted to: so many of each class in a frame, others in each. The encoder's choice.
class FitSchedule {
 public:
  explicit FitSchedule(const Hierarchy& hierarchy);

  // A chunk's number is its place among those of its class, in coding order.
  bool isFitted(std::uint32_t weightClass, std::uint32_t chunk, std::uint32_t frame) const {
    return (chunk + frame) % strides_[weightClass] == 0;
  }
  // All of a frame, class after class; of a class in coding order. `out` has room for kMaxChunks.
  std::size_t select(std::uint32_t frame, std::span<Phase> out) const;

  static constexpr std::size_t kMaxChunks = 72;

 private:
  std::array<std::vector<Phase>, kWeightClasses> chunks_;
  std::array<std::uint32_t, kWeightClasses> strides_{};
};

}  // namespace clothstream::codec::hierarchical
