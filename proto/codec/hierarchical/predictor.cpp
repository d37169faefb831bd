// SPDX-License-Identifier: MIT
// Prediction of a vertex in codec 2.
#include "proto/codec/hierarchical/predictor.h"

#include <algorithm>
#include <utility>

namespace clothstream::codec::hierarchical {

bool Predictor::allocate(const StreamLayout& layout, int stepBits) {
  setStepBits(stepBits);
  const std::size_t vertices = layout.vertexCount();
  bool allocated = hierarchy_.build(layout);
  for (Moment* const moment : {&newest_, &made_}) {
    allocated = allocated && moment->nodes.allocate(vertices + 1) && moment->records.allocate(vertices);
    if (allocated) moment->nodes[vertices] = Node{};
  }
  return allocated;
}

void Predictor::begin(bool key) {
  static constexpr Node kNoNode{};
  static constexpr Record kNoRecord{};
  work_ = {.key = key,
           .fineBits = stepBits_ - 4,
           .stride = key ? 0u : 1u,
           .pastNodes = key ? &kNoNode : newest_.nodes.data(),
           .pastRecords = key ? &kNoRecord : newest_.records.data(),
           .neighbours = hierarchy_.neighbours.data(),
           .nodes = made_.nodes.data(),
           .records = made_.records.data()};
}

FeatureVectors Predictor::features(std::uint32_t slot, const Prediction& p) const {
  const Record& past = work_.pastRecords[slot * work_.stride];
  const std::array<Int16x8, kPlainPairs> plain = plainFeatures(past, p);
  const Int16x8 locals = Int16x8::load(past.local);
  const Int32x4 now32 = locals.even(), change32 = now32 - locals.odd();
  const Int16x8 local = narrow(now32, change32);
  const Int16x8 tangents = interleaveHalves(p.frame.tangents);
  const Int16x8 normal = interleave(p.frame.normal, Int16x8::zero());
  const auto turned = [&](Int16x8 u_v, Int16x8 n_) {
    const int down = kUnitBits - kTurnedBits;
    const Int32x4 half = Int32x4::all(1 << (down - 1));
    const Int32x4 along = (dotPairs(tangents, u_v) + half).shiftedRight(down);
    const Int32x4 across = (dotPairs(normal, n_) + half).shiftedRight(down);
    return interleaveHalves(narrow(along, across));
  };
  return {plain[0],
          plain[1],
          plain[2],
          plain[3],
          plain[4],
          plain[5],
          turned(local.broadcastPair<0>(), local.broadcastPair<1>()),
          turned(local.broadcastPair<2>(), local.broadcastPair<3>())};
}

// Computes in 64 bits, since residuals may exceed 16 bits.
Int32x4 Predictor::reconstruct(const Prediction& prediction, const std::int32_t* r) const {
  alignas(16) std::int32_t position[4];
  alignas(16) std::int16_t tangents[8], normal[8];
  prediction.position.store(position);
  prediction.frame.tangents.store(tangents);
  prediction.frame.normal.store(normal);
  const int down = kUnitBits - stepBits_;
  constexpr std::int64_t kFar = 2 * std::int64_t{kMaxCoordinate};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::int64_t moved = std::int64_t{tangents[c]} * r[0] + std::int64_t{tangents[4 + c]} * r[1] +
                               std::int64_t{normal[c]} * r[2] + (std::int64_t{1} << (down - 1));
    position[c] = static_cast<std::int32_t>(std::clamp(position[c] + (moved >> down), -kFar, kFar));
  }
  return Int32x4::load(position);
}

void Predictor::interpolate(std::uint32_t begin, std::uint32_t end) {
  const Work work = work_;
  for (std::uint32_t slot = begin; slot < end; ++slot) {
    const Work::Surroundings around = work.surroundingsOf(slot);
    const Int32x4 ring = (around.ringSum + Int32x4::all(4)).shiftedRight(3) - around.average;
    const Int32x4 position = around.average - (ring + ring + ring).shiftedRight(4);
    position.store(&work.nodes[slot].x);
    work.nodes[slot].magnitudes = 0;
  }
}

void Predictor::keep(std::size_t slots) {
  const Work work = work_;
  const Node* nodes = work.nodes;
  const Nearest* const allNearest = hierarchy_.nearest.data();
  for (std::size_t slot = 0; slot < slots; ++slot) {
    const Nearest& nearest = allNearest[slot];
    const Int32x4 sum = nodes[nearest[0]].load() + nodes[nearest[1]].load() + nodes[nearest[2]].load() +
                        nodes[nearest[3]].load();
    const Int32x4 own = nodes[slot].load().shiftedLeft(2);
    Record& record = work.records[slot];
    record.magnitudes = static_cast<std::uint32_t>((sum + own).fourth());
    const Int32x4 curvature = (sum - own).shiftedRight(work.fineBits);
    const Int16x8 narrowed = narrow(curvature, curvature).withoutFourth();
    const Int16x8 present = interleave(narrowed, narrowed);
    const Int16x8 past = work.key ? present : Int16x8::load(record.curvatures).pairsSwapped();
    evenAndOdd(present, past).store(record.curvatures);
  }
  std::swap(newest_, made_);
}

}  // namespace clothstream::codec::hierarchical
