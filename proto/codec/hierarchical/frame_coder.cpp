// SPDX-License-Identifier: MIT
// What encoder and decoder of codec 2 agree on beside the prediction.
#include "proto/codec/hierarchical/frame_coder.h"

#include "proto/codec/reconstruction_hash.h"

namespace clothstream::codec::hierarchical {

LatticeUnit latticeUnit(float maxError) {
  const double error = static_cast<double>(maxError) - 0x1p-19;
  int stepBits = 8;
  const auto unit = [&] { return error / ((1 << (stepBits - 1)) + 2); };
  while (stepBits > 4 && unit() * kMaxCoordinate < 40) --stepBits;
  return {stepBits, static_cast<float>(unit())};
}

Weights keyFrameWeights() {
  Weights weights{};
  for (std::size_t c = 0; c < kWeightClasses; ++c) weights[c][kRingFeature] = -256;
  return weights;
}

Weights startingWeights() {
  Weights weights{};
  for (std::size_t c = 0; c < kWeightClasses; ++c) weights[c][kDetailChangeFeature] = 700;
  return weights;
}

WeightVectors weightVectors(const Weights& weights) {
  WeightVectors vectors;
  for (std::size_t c = 0; c < weights.size(); ++c) {
    for (std::size_t pair = 0; pair < kFeaturePairs; ++pair) {
      vectors[c][pair] = Int16x8::allPairs(weights[c][2 * pair], weights[c][2 * pair + 1]);
    }
  }
  return vectors;
}

std::uint64_t hashNodes(const Predictor& predictor) {
  ReconstructionHash hash;
  const std::span<const Node> nodes = predictor.nodes();
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    hash.add(predictor.hierarchy().vertexOf[slot], nodes[slot].x, nodes[slot].y, nodes[slot].z, 0);
  }
  return hash.value();
}

}  // namespace clothstream::codec::hierarchical
