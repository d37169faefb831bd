// SPDX-License-Identifier: MIT
// Least-squares fit of the weights that would have predicted the last frames best. Only the encoder uses it,
// so floating point is allowed.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

// Contribution of a chunk to its class's weights. For each feature i in order: the sums over the chosen
// vertices of feature i times feature j, for j from i up, then of feature i times the goal. Floats are added
// over the vertices for x, y and z separately, then over the axes. That order does not depend on the number
// of threads.
inline constexpr std::size_t kProducts = kFeatures * (kFeatures + 1) / 2 + kFeatures;
using ChunkProducts = std::array<float, kProducts>;

// Products of the chunk that is being coded.
class ProductSums {
 public:
  // `goal`: the sum that the weighted features should have had, in sixteenths of a step. Fourth lanes are
  // ignored.
  void add(const FeatureVectors& features, Int32x4 goal, float importance);
  // Sums since the last call.
  const ChunkProducts& take();

 private:
  alignas(16) std::array<std::array<float, 4>, kProducts> byAxis_{};
  ChunkProducts sums_{};
};

// 1 / x, up to an eighth too small. Unlike a quotient it is the same on every machine.
inline float roughReciprocal(std::uint32_t x) {
  return std::bit_cast<float>(0x7ef311c3u - std::bit_cast<std::uint32_t>(static_cast<float>(x)));
}

class WeightFitter {
 public:
  void add(std::size_t weightClass, const ChunkProducts& products);

  // Fits to everything that was added; older frames count less. Stays near `weights` where the data says
  // little, and nearer in a key frame, which is a single frame.
  void fit(Weights& weights, bool key);

  void clear() { classes_ = {}; }

 private:
  struct Sums {
    std::array<double, kProducts> fresh{}, all{};  // since the last fit; including earlier fits
  };

  std::array<Sums, kWeightClasses> classes_{};
};

// Schedule of the chunks that weights are fitted to: a number of each class in every frame, and different
// ones from frame to frame. Decoders do not depend on it.
class FitSchedule {
 public:
  explicit FitSchedule(const Hierarchy& hierarchy);

  // A chunk's number is its place among the chunks of its class, in coding order.
  bool isFitted(std::uint32_t weightClass, std::uint32_t chunk, std::uint32_t frame) const {
    return (chunk + frame) % strides_[weightClass] == 0;
  }
  // Selects all chunks of a frame, class after class; within a class in coding order. `out` has room for
  // kMaxChunks.
  std::size_t select(std::uint32_t frame, std::span<Phase> out) const;

  static constexpr std::size_t kMaxChunks = 72;

 private:
  std::array<std::vector<Phase>, kWeightClasses> chunks_;
  std::array<std::uint32_t, kWeightClasses> strides_{};
};

}  // namespace clothstream::codec::hierarchical
