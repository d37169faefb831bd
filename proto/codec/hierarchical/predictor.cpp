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
  bool allocated =
      hierarchy_.build(layout) && curvatures_.allocate(vertices) && magnitudes_.allocate(vertices);
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
  static constexpr Curvature kNoCurvature{};
  static constexpr std::uint32_t kNoMagnitudes = 0;
  key_ = key;
  stride_ = key ? 0 : 1;
  pastNodes_ = key ? &kNoNode : nodes_[1].data();
  pastCurvatures_ = key ? &kNoCurvature : curvatures_.data();
  pastMagnitudes_ = key ? &kNoMagnitudes : magnitudes_.data();
  // Before a history that is too short all was at rest.
  for (std::size_t i = 0; i < past_.size(); ++i) {
    past_[i] = key ? &kNoRecord : records_[std::min(i + 1, depth_)].data();
  }
}

// Residuals of more than 16 bits.
Int32x4 Predictor::reconstructFar(const Prediction& prediction, const std::int32_t* r) const {
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
  for (std::size_t slot = 0; slot < magnitudes_.size(); ++slot) {
    const std::array<std::uint32_t, 4>& nearest = hierarchy_.neighbours[slot].nearest;
    const Int32x4 sum = nodes[nearest[0]].load() + nodes[nearest[1]].load() + nodes[nearest[2]].load() +
                        nodes[nearest[3]].load();
    const Int32x4 own = nodes[slot].load().shiftedLeft(2);
    magnitudes_[slot] = static_cast<std::uint32_t>((sum + own).fourth());
    const Int32x4 curvature = (sum - own).shiftedRight(fineBits_);
    const Int16x8 narrowed = narrow(curvature, curvature).withoutFourth();
    const Int16x8 present = interleave(narrowed, narrowed);
    std::int16_t* newAndOld = curvatures_[slot].newAndOld;
    const Int16x8 past = key_ ? present : Int16x8::load(newAndOld).pairsSwapped();
    evenAndOdd(present, past).store(newAndOld);
  }
  std::swap(nodes_[0], nodes_[1]);
  std::rotate(records_.begin(), records_.end() - 1, records_.end());
  depth_ = key_ ? 1 : std::min<std::size_t>(depth_ + 1, past_.size());
}

}  // namespace clothstream::codec::hierarchical
