// SPDX-License-Identifier: MIT
// The weights that would have predicted the last frames best, by least squares. The encoder's own business:
// floating point serves.
#pragma once

#include <array>
#include <cstddef>

#include "proto/codec/hierarchical/predictor.h"

namespace clothstream::codec::hierarchical {

class WeightFitter {
 public:
  // `goal`: what the weighted features should have added up to, in sixteenths of a step. The fourth lanes are
  // ignored.
  void add(std::size_t weightClass, const FeatureVectors& features, Int32x4 goal, float importance);

  // To all that was added, the older the less; stays near `weights` where that says little.
  void fit(Weights& weights);

  void clear() { classes_ = {}; }

 private:
  static constexpr std::size_t kColumns = kFeatures + 1;
  // Row i, column j >= i: the sum of feature i times feature j, or times the goal in the last column.
  struct Sums {
    // Since the last fit, by lane.
    alignas(16) std::array<std::array<float, 4>, kFeatures * kColumns> fresh{};
    std::array<double, kFeatures * kColumns> all{};
  };

  std::array<Sums, kWeightClasses> classes_{};
};

}  // namespace clothstream::codec::hierarchical
