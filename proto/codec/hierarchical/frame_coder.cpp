// SPDX-License-Identifier: MIT
// Definitions that encoder and decoder of codec 2 share, apart from the prediction.
#include "proto/codec/hierarchical/frame_coder.h"

#include <algorithm>
#include <cmath>

#include "proto/codec/reconstruction_hash.h"

namespace clothstream::codec::hierarchical {

LatticeUnit latticeUnit(float maxError) {
  const double error = static_cast<double>(maxError) - 0x1p-19;
  int stepBits = 8;
  const auto unit = [&] { return error / ((1 << (stepBits - 1)) + 2); };
  while (stepBits > 4 && unit() * kMaxCoordinate < 40) --stepBits;
  return {stepBits, static_cast<float>(unit())};
}

double quantisationScale(float unit) {
  int exponent;
  const double mantissa = std::frexp(1 / static_cast<double>(unit), &exponent);
  return std::ldexp(std::round(std::ldexp(mantissa, kScaleBits)), exponent - kScaleBits);
}

Weights keyFrameWeights() {
  Weights weights{};
  for (std::size_t c = 0; c < kWeightClasses; ++c) weights[c][kRingFeature] = -192;
  return weights;
}

Weights startingWeights() {
  Weights weights{};
  for (std::size_t c = 0; c < kWeightClasses; ++c) weights[c][kDetailChangeFeature] = 700;
  return weights;
}

std::array<WeightVectors, kWeightClasses + 1> weightVectors(const Weights& weights) {
  std::array<WeightVectors, kWeightClasses + 1> vectors;
  for (std::size_t c = 0; c < weights.size(); ++c) {
    const auto& w = weights[c];
    for (std::size_t pair = 0; pair < kPlainPairs; ++pair) {
      vectors[c].plain[pair] = Int16x8::allPairs(w[2 * pair], w[2 * pair + 1]);
    }
    // Weights of the present and of the previous value.
    const auto now = [&](std::size_t f) { return static_cast<std::int16_t>(w[f] + w[f + 2]); };
    const auto before = [&](std::size_t f) { return static_cast<std::int16_t>(-w[f + 2]); };
    constexpr std::size_t along = 2 * kPlainPairs, across = along + 1;
    vectors[c].local =
        Int16x8::of(now(along), before(along), now(along), before(along), now(across), before(across));
  }
  return vectors;
}

std::uint64_t hashNodes(const Predictor& predictor, std::span<const FacedNormal> normals) {
  ReconstructionHash hash;
  const std::span<const Node> nodes = predictor.nodes();
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    const std::uint32_t vertex = predictor.hierarchy().vertexOf[slot];
    const Octahedral n = normals.empty() ? Octahedral{} : normals[vertex].octahedral;
    const std::uint32_t normal =
        static_cast<std::uint8_t>(n.u) | std::uint32_t{static_cast<std::uint8_t>(n.v)} << 8;
    hash.add(vertex, nodes[slot].x, nodes[slot].y, nodes[slot].z, normal);
  }
  return hash.value();
}

}  // namespace clothstream::codec::hierarchical
