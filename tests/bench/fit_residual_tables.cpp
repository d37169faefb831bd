// SPDX-License-Identifier: MIT
// Fits the tables of codec 2 to moving cloth and prints residual_tables.cpp. Only for changes of the format.
// The motions differ from those of suite codec.
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "proto/codec/hierarchical/hierarchical_encoder.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/zigzag.h"
#include "tests/bench/cloth_motion.h"

namespace clothstream::bench {
namespace {

using codec::hierarchical::CodedResidual;
using namespace codec::hierarchical;

constexpr std::size_t kTerms = 6;  // number of ScaleWeights' terms
using Terms = std::array<double, kTerms>;
using Estimators = std::array<std::array<Terms, kComponents>, kScaleClasses>;

// An encoder that is fed a motion.
struct Trainee {
  Trainee(const codec::ClothLayout& cloth, bool onlyKeys, float maxError)
      : keysAlone(onlyKeys),
        encoder({.epoch = 1, .codec = codec::kCodecHierarchical, .maxError = maxError, .cloths = {cloth}}),
        packet(encoder.packetBound()) {}

  void code(std::uint32_t frame, std::span<const float> positions, std::vector<CodedResidual>& residuals) {
    if (keysAlone && frame % 20 != 0) return;
    const bool key = keysAlone || frame == 0 || frame == 60;
    const bool counts = keysAlone || (frame >= 6 && (frame < 10 || frame % 3 == 0 || frame == 61));
    encoder.record(counts ? &residuals : nullptr);
    const auto kind = key ? codec::PacketKind::key : codec::PacketKind::predicted;
    encoder.encode({.tick = frame + 1, .kind = kind, .referenceTick = frame}, positions, {}, packet);
  }

  bool keysAlone;  // only key frames, and few of them
  HierarchicalEncoder encoder;
  std::vector<std::byte> packet;
};

std::vector<CodedResidual> codeMotions() {
  const std::array motions{
      MotionSettings{.name = "",
                     .scene = MotionScene::flag,
                     .wind = 0.8,
                     .size = 80,
                     .substeps = 16,
                     .damping = 1.5,
                     .seed = 5},
      MotionSettings{
          .name = "", .scene = MotionScene::drape, .size = 72, .substeps = 16, .damping = 1.5, .seed = 9},
      MotionSettings{
          .name = "", .scene = MotionScene::curtain, .size = 90, .substeps = 16, .damping = 2.5, .seed = 4},
      MotionSettings{.name = "", .scene = MotionScene::flag, .wind = 0.35, .size = 110, .seed = 11}};
  std::vector<CodedResidual> residuals;
  for (MotionSettings motion : motions) {
    motion.frames = 200;
    const codec::ClothLayout cloth{motion.size * motion.size, motion.size, motion.size};
    std::deque<Trainee> trainees;
    for (const float maxError : {0.001f, 0.0005f, 0.00025f}) {
      for (const bool keysAlone : {false, true}) trainees.emplace_back(cloth, keysAlone, maxError);
    }
    playMotion(motion, [&](std::uint32_t frame, std::span<const float> positions) {
      for (Trainee& trainee : trainees) trainee.code(frame, positions, residuals);
    });
  }
  return residuals;
}

Terms termsOf(const CodedResidual& r) {
  const double normal = r.component == kAlongNormal ? 0 : r.normal, u = r.component == kAlongV ? r.u : 0;
  return {
      static_cast<double>(r.parents), static_cast<double>(r.ring), static_cast<double>(r.last), normal, u, 1};
}

double expectation(const Terms& weights, const Terms& terms) {
  double sum = 0;
  for (std::size_t i = 0; i < kTerms; ++i) sum += weights[i] * terms[i];
  return sum;
}

// Weighted least squares by Gauss-Jordan elimination, in steps.
Terms fit(const std::vector<CodedResidual>& residuals, std::size_t scaleClass, std::size_t component,
          Terms weights) {
  for (int pass = 0; pass < 6; ++pass) {
    std::array<std::array<double, kTerms + 1>, kTerms> m{};
    for (const CodedResidual& r : residuals) {
      if (r.scaleClass != scaleClass || r.component != component) continue;
      const Terms terms = termsOf(r);
      // An error counts relative to the expected magnitude.
      const double expected = std::max(expectation(weights, terms), 0.02);
      const double importance = 1 / (expected * expected + 0.02 * expected);
      for (std::size_t i = 0; i < kTerms; ++i) {
        for (std::size_t j = 0; j < kTerms; ++j) m[i][j] += importance * terms[i] * terms[j];
        m[i][kTerms] += importance * terms[i] * std::min(std::abs(r.residual), 40);
      }
    }
    for (std::size_t i = 0; i < kTerms; ++i) m[i][i] = 1.0005 * m[i][i] + 1e-6;
    for (std::size_t i = 0; i < kTerms; ++i) {
      for (std::size_t j = 0; j < kTerms; ++j) {
        if (j == i) continue;
        const double part = m[j][i] / m[i][i];
        for (std::size_t k = i; k <= kTerms; ++k) m[j][k] -= part * m[i][k];
      }
    }
    for (std::size_t i = 0; i < kTerms; ++i) weights[i] = m[i][kTerms] / m[i][i];
    weights[kTerms - 1] = std::max(weights[kTerms - 1], 1 / 256.0);
  }
  return weights;
}

// Frequencies of the counts, mixed with a little of a geometric distribution of that scale.
Distribution toDistribution(const std::array<double, kSymbols>& counts, std::uint32_t scale) {
  const unsigned raw = rawBits(scale);
  const double expected = std::exp2(scale / 2.0 + 2.25) / 256 / (1u << raw), decay = std::max(0.1, expected);
  std::array<double, kSymbols> geometric, parts;
  double sum = 0, total = 0;
  for (std::size_t i = 0; i < kSymbols; ++i) {
    geometric[i] = std::exp(-static_cast<double>((i + 1) / 2) / decay);
    sum += geometric[i];
    total += counts[i];
  }
  for (std::size_t i = 0; i < kSymbols; ++i) parts[i] = (counts[i] + 30 * geometric[i] / sum) / (total + 30);
  // Both signs are equally likely.
  for (std::size_t i = 1; raw == 0 && i + 1 < kEscape; i += 2)
    parts[i] = parts[i + 1] = (parts[i] + parts[i + 1]) / 2;
  Distribution frequencies;
  int left = 1 << kProbabilityBits;
  for (std::size_t i = 0; i < kSymbols; ++i) {
    const double share = parts[i] * ((1 << kProbabilityBits) - static_cast<int>(kSymbols));
    frequencies[i] = static_cast<std::int16_t>(std::max(1.0, std::round(share)));
    left -= frequencies[i];
  }
  std::int16_t& largest = *std::max_element(frequencies.begin(), frequencies.end());
  largest = static_cast<std::int16_t>(largest + left);
  return frequencies;
}

void print(const Estimators& estimators, const std::array<Distribution, 2 * kScales>& distributions) {
  fmt::print(
      "// SPDX-License-Identifier: MIT\n// Fitted by tests/bench/fit_residual_tables.cpp.\n"
      "#include \"proto/codec/hierarchical/residual_model.h\"\n\n"
      "namespace clothstream::codec::hierarchical {{\n\n// clang-format off\n"
      "const std::array<std::array<ScaleWeights, kComponents>, kScaleClasses> kScaleWeights{{{{\n");
  for (std::size_t c = 0; c < kScaleClasses; ++c) {
    fmt::print("    {{{{");
    for (std::size_t k = 0; k < kComponents; ++k)
      fmt::print("{}{{{}}}", k == 0 ? "" : ", ", fmt::join(estimators[c][k], ", "));
    fmt::print("}}}}{}\n", c + 1 < kScaleClasses ? "," : "}};\n");
  }
  fmt::print("const std::array<Distribution, 2 * kScales> kDistributions{{{{\n");
  for (std::size_t t = 0; t < distributions.size(); ++t) {
    fmt::print("    {{{{{}}}}}{}\n", fmt::join(distributions[t], ", "),
               t + 1 < distributions.size() ? "," : "}};");
  }
  fmt::print("// clang-format on\n\n}}  // namespace clothstream::codec::hierarchical\n");
}

void fitTables() {
  const std::vector<CodedResidual> residuals = codeMotions();
  Estimators estimators;  // rounded, in 1/256 of a step, as printed
  for (std::size_t c = 0; c < kScaleClasses; ++c) {
    for (std::size_t k = 0; k < kComponents; ++k) {
      const Terms fitted = fit(residuals, c, k, {0.05, 0.02, 0.03, 0.02, 0.02, 0.01});
      for (std::size_t i = 0; i < kTerms; ++i)
        estimators[c][k][i] = std::round(256 * fitted[i]) + 0.0;  // avoids -0
    }
  }
  std::array<std::array<double, kSymbols>, 2 * kScales> counts{};
  for (const CodedResidual& r : residuals) {
    const double expected = expectation(estimators[r.scaleClass][r.component], termsOf(r));
    const std::uint32_t scale = scaleOf(static_cast<std::int32_t>(expected));
    const std::uint32_t symbol = std::min(codec::zigzag(r.residual) >> rawBits(scale), kEscape);
    counts[distributionOf(static_cast<Component>(r.component), scale)][symbol] += 1;
  }
  std::array<Distribution, 2 * kScales> distributions;
  for (std::size_t t = 0; t < counts.size(); ++t) {
    distributions[t] = toDistribution(counts[t], static_cast<std::uint32_t>(t % kScales));
  }
  print(estimators, distributions);
}

}  // namespace
}  // namespace clothstream::bench

int main() {
  clothstream::bench::fitTables();
  return 0;
}
