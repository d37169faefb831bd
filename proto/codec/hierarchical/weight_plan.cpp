// SPDX-License-Identifier: MIT
// Plan of the weights that a frame predicts with.
#include "proto/codec/hierarchical/weight_plan.h"

#include <cassert>

#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Weights are fitted and sent every kWeightInterval frames, and in the first kEagerFrames frames that can.
constexpr std::uint32_t kWeightInterval = 4, kEagerFrames = 3;
// For fewer vertices the weights cost more than they save.
constexpr std::uint32_t kFewVertices = 100;

}  // namespace

WeightPlan::WeightPlan(const Hierarchy& hierarchy, std::uint8_t layers, std::uint32_t lag)
    : lag_(lag), layers_(layers), fitters_(layers), keyWeights_(keyFrameWeights()) {
  assert(lag == 0 || layers == 1);
  for (const Phase& phase : hierarchy.phases) classSizes_[phase.weightClass] += phase.end - phase.begin;
  kept_[0][0] = startingWeights();
  if (lag > 0) planned_.assign(lag + 1, {.weights = startingWeights(), .keyWeights = keyWeights_});
}

void WeightPlan::begin(const FrameRole& role) {
  key_ = role.kind == PacketKind::key;
  if (key_) beforeKey_ = kept_[0][0];
  sinceKey_ = key_ ? 0 : sinceKey_ + 1;
  layer_ = role.layer;
  weights_ = key_ ? LayerWeights{keyFrameWeights()} : kept_[role.referenceLayer];
  used_ = weights_[layer_];
}

void WeightPlan::retry() {
  for (WeightFitter& fitter : fitters_) fitter.clear();
}

bool WeightPlan::isDue(std::uint32_t sinceKey, bool quiet) const {
  if (sinceKey == 0) return true;
  // With layers the base sends the weights of all layers, because it is never dropped.
  const bool eager = layers_ == 1 && sinceKey <= lag_ + kEagerFrames;
  return sinceKey > lag_ && !quiet && (eager || sinceKey % kWeightInterval == 0);
}

const Weights* WeightPlan::planned(std::uint64_t number, std::uint32_t sinceKey) const {
  const Planned& plan = planned_[number % planned_.size()];
  if (sinceKey == 0) return &plan.keyWeights;
  return sinceKey == 1 || (sinceKey > lag_ && plan.isDue) ? &plan.weights : nullptr;
}

std::size_t WeightPlan::write(bool atRest, std::byte* out) {
  if (atRest) {
    used_ = Weights{};
    out[0] = std::byte{1};
    return 1;
  }
  std::size_t bytes = 0;
  const Weights* const plan = lag_ > 0 ? planned(number_, sinceKey_) : nullptr;
  if (lag_ > 0 ? plan != nullptr : layer_ == 0 && isDue(sinceKey_, quiet_)) {
    BitWriter writer(out);
    writer.put(0, 1);
    for (std::size_t of = 0; of < (key_ ? 1u : layers_); ++of)
      writeChanges(of, lag_ > 0 ? *plan : next(of), writer);
    bytes = static_cast<std::size_t>(writer.finish() - out);
  }
  used_ = weights_[layer_];
  return bytes;
}

// Motion after a key frame is expected to be like the motion before it.
Weights WeightPlan::next(std::size_t of) {
  return sinceKey_ == 1 && layers_ == 1 ? beforeKey_ : fitted(of);
}

Weights WeightPlan::fitted(std::size_t of) {
  Weights next = weights_[of];
  fitters_[of].fit(next, key_);
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    for (std::size_t f = 0; f < kFeatures; ++f) {
      const bool isFixed = key_ && (f < firstWeight(true) || f >= endWeight(true));
      if (classSizes_[c] < kFewVertices || isFixed) next[c][f] = weights_[of][c][f];
    }
  }
  return next;
}

void WeightPlan::writeChanges(std::size_t of, const Weights& next, BitWriter& writer) {
  Weights& current = weights_[of];
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    const bool changes = next[c] != current[c];
    writer.put(changes ? 1 : 0, 1);
    if (!changes) continue;
    for (std::size_t f = firstWeight(key_); f < endWeight(key_); ++f)
      writer.putGamma(zigzag(next[c][f] - current[c][f]), kWeightGammaBits);
    current[c] = next[c];
  }
}

void WeightPlan::end(bool quiet) {
  quiet_ = quiet;
  if (lag_ > 0) plan(quiet);
  if (key_) {
    weights_.fill(startingWeights());
    retry();
  }
  kept_[layer_] = weights_;
  ++number_;
}

void WeightPlan::plan(bool quiet) {
  if (key_) {
    weights_[0] = keyFrameWeights();
    keyWeights_ = fitted(0);
  }
  Planned& plan = planned_[(number_ + lag_) % planned_.size()];
  plan.keyWeights = keyWeights_;
  plan.isDue = !key_ && isDue(sinceKey_ + lag_, quiet);
  plan.weights = plan.isDue ? fitted(0) : key_ ? beforeKey_ : weights_[0];
}

}  // namespace clothstream::codec::hierarchical
