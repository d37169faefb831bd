// SPDX-License-Identifier: MIT
// Least squares for the weights.
#include "proto/codec/hierarchical/weight_fitter.h"

#include <algorithm>
#include <cmath>

namespace clothstream::codec::hierarchical {
namespace {

constexpr double kFade = 0.75;  // of what was known, at each fit
constexpr double kStay = 0.01;  // how much the former weights count beside what was added

using Matrix = std::array<std::array<double, kFeatures>, kFeatures>;
using Vector = std::array<double, kFeatures>;

// x with m x = x as it was; m is symmetric and positive definite, and overwritten (Cholesky).
void solve(Matrix& m, Vector& x) {
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

void WeightFitter::add(std::size_t weightClass, const FeatureVectors& features, Int32x4 goal,
                       float importance) {
  simde__m128 values[kColumns];
  const simde__m128 lanes = simde_mm_setr_ps(1, 1, 1, 0);
  for (std::size_t pair = 0; pair < kFeaturePairs; ++pair) {
    values[2 * pair] = simde_mm_cvtepi32_ps(features[pair].even().v);
    values[2 * pair + 1] = simde_mm_cvtepi32_ps(features[pair].odd().v);
  }
  for (std::size_t i = 2 * kPlainPairs; i < kFeatures; ++i)
    values[i] = simde_mm_mul_ps(values[i], simde_mm_set1_ps(1.0f / (1 << kTurnedBits)));
  values[kFeatures] = simde_mm_cvtepi32_ps(goal.v);
  const simde__m128 scale = simde_mm_mul_ps(lanes, simde_mm_set1_ps(importance));
  auto& sums = classes_[weightClass].fresh;
  for (std::size_t i = 0; i < kFeatures; ++i) {
    const simde__m128 left = simde_mm_mul_ps(values[i], scale);
    for (std::size_t j = i; j < kColumns; ++j) {
      float* sum = sums[i * kColumns + j].data();
      simde_mm_store_ps(sum, simde_mm_add_ps(simde_mm_load_ps(sum), simde_mm_mul_ps(left, values[j])));
    }
  }
}

void WeightFitter::fit(Weights& weights) {
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    Sums& sums = classes_[c];
    for (std::size_t i = 0; i < sums.all.size(); ++i) {
      const std::array<float, 4>& fresh = sums.fresh[i];
      sums.all[i] = kFade * sums.all[i] + static_cast<double>(fresh[0] + fresh[1] + fresh[2]);
    }
    sums.fresh = {};
    Matrix m;
    Vector x;
    double trace = 0;
    for (std::size_t i = 0; i < kFeatures; ++i) trace += sums.all[i * kColumns + i];
    for (std::size_t i = 0; i < kFeatures; ++i) {
      for (std::size_t j = 0; j < kFeatures; ++j)
        m[i][j] = sums.all[std::min(i, j) * kColumns + std::max(i, j)];
      const double stay = kStay * (m[i][i] + 1e-3 * trace / kFeatures) + 1e-9;
      m[i][i] += stay;
      x[i] = sums.all[i * kColumns + kFeatures] + stay * weights[c][i] / (1 << kWeightBits);
    }
    solve(m, x);
    for (std::size_t i = 0; i < kFeatures; ++i) {
      const double weight =
          std::clamp(std::round(x[i] * (1 << kWeightBits)), -double{kMaxWeight}, double{kMaxWeight});
      weights[c][i] = static_cast<std::int16_t>(weight);
    }
  }
}

}  // namespace clothstream::codec::hierarchical
