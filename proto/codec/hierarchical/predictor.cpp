// SPDX-License-Identifier: MIT
// Where codec 2 expects a vertex.
#include "proto/codec/hierarchical/predictor.h"

#include <algorithm>
#include <utility>

namespace clothstream::codec::hierarchical {

bool Predictor::allocate(const StreamLayout& layout, int stepBits) {
  stepBits_ = stepBits;
  fineBits_ = stepBits - 4;
  const std::size_t vertices = layout.vertexCount();
  bool allocated = hierarchy_.build(layout);
  for (Array<Node>& nodes : nodes_) {
    allocated = allocated && nodes.allocate(vertices + 1);
    if (allocated) nodes[vertices] = Node{};
  }
  for (Array<Record>& records : records_) allocated = allocated && records.allocate(vertices);
  return allocated;
}

void Predictor::begin(bool key) {
  static constexpr Node kNoNode{};
  static constexpr Record kNoRecord{};
  key_ = key;
  stride_ = key ? 0 : 1;
  pastNodes_ = key ? &kNoNode : nodes_[1].data();
  pastRecords_ = key ? &kNoRecord : records_[1].data();
}

FeatureVectors Predictor::features(std::uint32_t slot, const Prediction& p) const {
  const Record& past = pastRecords_[slot * stride_];
  const std::array<Int16x8, kPlainPairs> plain = plainFeatures(past, p);
  const Int16x8 locals = Int16x8::load(past.local);
  const Int32x4 now32 = locals.even(), change32 = now32 - locals.odd();
  const Int16x8 local = narrow(now32, change32);
  const Int16x8 tangents = interleaveHalves(p.frame.tangents);
  const Int16x8 normal = interleave(p.frame.normal, Int16x8::zero());
  const auto turned = [&](Int16x8 u_v, Int16x8 n_) {
    const Int32x4 along = dotPairs(tangents, u_v).shiftedRight(kUnitBits);
    const Int32x4 across = dotPairs(normal, n_).shiftedRight(kUnitBits);
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

// In 64 bits: residuals may be of more than 16.
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

void Predictor::keep() {
  const Node* nodes = nodes_[0].data();
  for (std::size_t slot = 0; slot < hierarchy_.vertexOf.size(); ++slot) {
    const Nearest& nearest = hierarchy_.nearest[slot];
    const Int32x4 sum = nodes[nearest[0]].load() + nodes[nearest[1]].load() + nodes[nearest[2]].load() +
                        nodes[nearest[3]].load();
    const Int32x4 own = nodes[slot].load().shiftedLeft(2);
    Record& record = records_[0][slot];
    record.magnitudes = static_cast<std::uint32_t>((sum + own).fourth());
    const Int32x4 curvature = (sum - own).shiftedRight(fineBits_);
    const Int16x8 narrowed = narrow(curvature, curvature).withoutFourth();
    const Int16x8 present = interleave(narrowed, narrowed);
    const Int16x8 past = key_ ? present : Int16x8::load(record.curvatures).pairsSwapped();
    evenAndOdd(present, past).store(record.curvatures);
  }
  std::swap(nodes_[0], nodes_[1]);
  std::swap(records_[0], records_[1]);
}

}  // namespace clothstream::codec::hierarchical
