// SPDX-License-Identifier: MIT
// Plan of the weights that a frame predicts with.
#include "proto/codec/hierarchical/weight_plan.h"

#include <utility>

#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Weights are fitted and sent every kWeightInterval frames, and in the first kEagerFrames frames that can.
constexpr std::uint32_t kWeightInterval = 4, kEagerFrames = 3;
// For fewer vertices the weights cost more than they save.
constexpr std::uint32_t kFewVertices = 100;

}  // namespace

WeightPlan::WeightPlan(const Hierarchy& hierarchy, std::uint32_t lag)
    : lag_(lag), weights_(startingWeights()), keyWeights_(keyFrameWeights()) {
  for (const Phase& phase : hierarchy.phases) classSizes_[phase.weightClass] += phase.end - phase.begin;
  if (lag > 0) planned_.assign(lag + 1, {.weights = startingWeights(), .keyWeights = keyWeights_});
}

void WeightPlan::begin(bool key) {
  key_ = key;
  if (key_) beforeKey_ = std::exchange(weights_, keyFrameWeights());
  sinceKey_ = key_ ? 0 : sinceKey_ + 1;
  used_ = weights_;
}

void WeightPlan::retry() {
  fitter_.clear();
}

bool WeightPlan::isDue(std::uint32_t sinceKey, bool quiet) const {
  if (sinceKey == 0) return true;
  const bool eager = sinceKey <= lag_ + kEagerFrames;
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
  if (lag_ > 0 ? plan != nullptr : isDue(sinceKey_, quiet_)) {
    BitWriter writer(out);
    writer.put(0, 1);
    // Motion after a key frame is expected to be like the motion before it.
    writeChanges(lag_ > 0 ? *plan : sinceKey_ == 1 ? beforeKey_ : fitted(), writer);
    bytes = static_cast<std::size_t>(writer.finish() - out);
  }
  used_ = weights_;
  return bytes;
}

Weights WeightPlan::fitted() {
  Weights next = weights_;
  fitter_.fit(next, key_);
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    for (std::size_t f = 0; f < kFeatures; ++f) {
      const bool isFixed = key_ && (f < firstWeight(true) || f >= endWeight(true));
      if (classSizes_[c] < kFewVertices || isFixed) next[c][f] = weights_[c][f];
    }
  }
  return next;
}

void WeightPlan::writeChanges(const Weights& next, BitWriter& writer) {
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    const bool changes = next[c] != weights_[c];
    writer.put(changes ? 1 : 0, 1);
    if (!changes) continue;
    for (std::size_t f = firstWeight(key_); f < endWeight(key_); ++f)
      writer.putGamma(zigzag(next[c][f] - weights_[c][f]), kWeightGammaBits);
    weights_[c] = next[c];
  }
}

void WeightPlan::end(bool quiet) {
  quiet_ = quiet;
  if (lag_ > 0) plan(quiet);
  if (key_) {
    weights_ = startingWeights();
    retry();
  }
  ++number_;
}

void WeightPlan::plan(bool quiet) {
  if (key_) {
    weights_ = keyFrameWeights();
    keyWeights_ = fitted();
  }
  Planned& plan = planned_[(number_ + lag_) % planned_.size()];
  plan.keyWeights = keyWeights_;
  plan.isDue = !key_ && isDue(sinceKey_ + lag_, quiet);
  plan.weights = plan.isDue ? fitted() : key_ ? beforeKey_ : weights_;
}

}  // namespace clothstream::codec::hierarchical
