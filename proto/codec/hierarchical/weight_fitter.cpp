// SPDX-License-Identifier: MIT
// Least squares for the weights.
#include "proto/codec/hierarchical/weight_fitter.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace clothstream::codec::hierarchical {
namespace {

constexpr double kFade = 0.75;                    // part of earlier data that is kept at each fit
constexpr double kStay = 0.01, kStayOfKey = 0.1;  // weight of the former weights, compared with the data
// Chunks of each class in a frame. More of a large cloth would add no information.
constexpr std::array<std::uint32_t, kWeightClasses> kFittedChunks{8, 16, 6, 12, 10, 20};

using Matrix = std::array<std::array<double, kFeatures>, kFeatures>;
using SystemVector = std::array<double, kFeatures>;

// Solves m x = b by Cholesky factorisation; x holds b on entry. m is symmetric and positive definite, and is
// overwritten.
void solve(Matrix& m, SystemVector& x) {
  for (std::size_t j = 0; j < kFeatures; ++j) {
    for (std::size_t k = 0; k < j; ++k) m[j][j] -= m[j][k] * m[j][k];
    m[j][j] = std::sqrt(std::max(m[j][j], 1e-12));
    for (std::size_t i = j + 1; i < kFeatures; ++i) {
      for (std::size_t k = 0; k < j; ++k) m[i][j] -= m[i][k] * m[j][k];
      m[i][j] /= m[j][j];
    }
  }
  for (std::size_t i = 0; i < kFeatures; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= m[i][k] * x[k];
    x[i] /= m[i][i];
  }
  for (std::size_t i = kFeatures; i-- > 0;) {
    for (std::size_t k = i + 1; k < kFeatures; ++k) x[i] -= m[k][i] * x[k];
    x[i] /= m[i][i];
  }
}

}  // namespace

void ProductSums::add(const FeatureVectors& features, Int32x4 goal, float importance) {
  simde__m128 values[kFeatures + 1];
  for (std::size_t pair = 0; pair < kFeaturePairs; ++pair) {
    values[2 * pair] = simde_mm_cvtepi32_ps(features[pair].even().v);
    values[2 * pair + 1] = simde_mm_cvtepi32_ps(features[pair].odd().v);
  }
  for (std::size_t i = 2 * kPlainPairs; i < kFeatures; ++i)
    values[i] = simde_mm_mul_ps(values[i], simde_mm_set1_ps(1.0f / (1 << kTurnedBits)));
  values[kFeatures] = simde_mm_cvtepi32_ps(goal.v);
  const simde__m128 scale = simde_mm_set1_ps(importance);
  auto sum = byAxis_.begin();
  for (std::size_t i = 0; i < kFeatures; ++i) {
    const simde__m128 left = simde_mm_mul_ps(values[i], scale);
    for (std::size_t j = i; j <= kFeatures; ++j, ++sum) {
      simde_mm_store_ps(sum->data(),
                        simde_mm_add_ps(simde_mm_load_ps(sum->data()), simde_mm_mul_ps(left, values[j])));
    }
  }
}

const ChunkProducts& ProductSums::take() {
  for (std::size_t i = 0; i < kProducts; ++i) {
    const std::array<float, 4>& sum = byAxis_[i];
    sums_[i] = sum[0] + sum[1] + sum[2];
  }
  byAxis_ = {};
  return sums_;
}

void WeightFitter::add(std::size_t weightClass, const ChunkProducts& products) {
  std::array<double, kProducts>& fresh = classes_[weightClass].fresh;
  for (std::size_t i = 0; i < kProducts; ++i) fresh[i] += static_cast<double>(products[i]);
}

void WeightFitter::fit(Weights& weights, bool key) {
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    Sums& sums = classes_[c];
    for (std::size_t i = 0; i < kProducts; ++i) sums.all[i] = kFade * sums.all[i] + sums.fresh[i];
    sums.fresh = {};
    Matrix m;
    SystemVector x;
    double trace = 0;
    auto product = sums.all.begin();
    for (std::size_t i = 0; i < kFeatures; ++i) {
      trace += *product;
      for (std::size_t j = i; j < kFeatures; ++j) m[i][j] = m[j][i] = *product++;
      x[i] = *product++;
    }
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const double stay = (key ? kStayOfKey : kStay) * (m[i][i] + 1e-3 * trace / kFeatures) + 1e-9;
      m[i][i] += stay;
      x[i] += stay * weights[c][i] / (1 << kWeightBits);
    }
    solve(m, x);
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const double weight =
          std::clamp(std::round(x[i] * (1 << kWeightBits)), -double{kMaxWeight}, double{kMaxWeight});
      weights[c][i] = static_cast<std::int16_t>(weight);
    }
  }
}

FitSchedule::FitSchedule(const Hierarchy& hierarchy) {
  for (const Phase& phase : hierarchy.phases) {
    if (phase.weightClass == kWeightClasses) continue;
    for (std::uint32_t begin = phase.begin; begin < phase.end; begin += kChunk)
      chunks_[phase.weightClass].push_back({begin, std::min(begin + kChunk, phase.end), phase.weightClass});
  }
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    const auto chunks = static_cast<std::uint32_t>(chunks_[c].size());
    strides_[c] = std::max(1u, (chunks + kFittedChunks[c] - 1) / kFittedChunks[c]);
  }
}

std::size_t FitSchedule::select(std::uint32_t frame, std::span<Phase> out) const {
  static_assert(std::accumulate(kFittedChunks.begin(), kFittedChunks.end(), std::size_t{0}) == kMaxChunks);
  std::size_t count = 0;
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    const std::uint32_t stride = strides_[c];
    for (std::size_t i = (stride - frame % stride) % stride; i < chunks_[c].size(); i += stride)
      out[count++] = chunks_[c][i];
  }
  return count;
}

}  // namespace clothstream::codec::hierarchical
