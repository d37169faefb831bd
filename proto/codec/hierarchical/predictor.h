// SPDX-License-Identifier: MIT
// Where codec 2 expects a vertex: from those coded before it in this frame, and from what all of them did in
// the frames before. The same integers at both ends.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/hierarchical/lanes.h"
#include "proto/codec/hierarchical/surface_frame.h"

namespace clothstream::codec::hierarchical {

// |x|, |y| and |z| of a position in units are this at most: sums of eight stay within 32 bits.
inline constexpr std::int32_t kMaxCoordinate = 1 << 27;
// Residuals count as this at most where they tell what others will be like: eight sums fit a byte.
inline constexpr std::uint32_t kMaxMagnitude = 31;

// A vertex's position, in units. In `magnitudes` the lowest byte is the residual along u without its sign, at
// most kMaxMagnitude, the next along v, then n: loaded and added up together with the position. In the
// highest byte is 1 where the vertex rests: it is exactly where it was in the frame before.
struct alignas(16) Node {
  std::int32_t x = 0, y = 0, z = 0;
  std::uint32_t magnitudes = 0;

  Int32x4 load() const { return Int32x4::load(&x); }
  bool rests() const { return magnitudes >> 24 != 0; }
};

// What the frames to come need of a vertex. 16-bit vectors are in sixteenths of a step, saturated.
struct alignas(16) Record {
  std::int32_t average[4];        // of the parents
  std::int16_t detailAndRing[8];  // of the vertex, and of the ring, relative to that average: x x y y z z
  std::int16_t twistAndRing[8];   // half the difference of the two pairs of parents; the ring's once more
  std::int16_t local[8];          // the detail along u, v and n
};

// What predicts a change: vectors in sixteenths of a step, interleaved by two, and their weights.
inline constexpr std::size_t kFeaturePairs = 8;
inline constexpr std::size_t kFeatures = 2 * kFeaturePairs;
inline constexpr std::size_t kRingFeature = 1, kDetailChangeFeature = 2;
using FeatureVectors = std::array<Int16x8, kFeaturePairs>;

// A weight of 1 is 2^kWeightBits.
inline constexpr int kWeightBits = 10;
inline constexpr std::int32_t kMaxWeight = 2047;
// The last class, of the corners, has none.
using Weights = std::array<std::array<std::int16_t, kFeatures>, kWeightClasses + 1>;

// What is known of a vertex before its residual.
struct Prediction {
  Int32x4 position, average;
  Int32x4 last;  // position; of no meaning in a key frame
  SurfaceFrame frame;
  Int16x8 ring, twistRing;  // the ring at the odd lanes; both as in the record
  // Sums over the parents, over the ring, and of the last frame: of this vertex four times and of the
  // nearest.
  std::uint32_t parentMagnitudes, ringMagnitudes, lastMagnitudes;
};

// A frame is begin(), then predict() and place() for all vertices in coding order, then keep(), or nothing
// where the frame is given up.
class Predictor {
 public:
  // Residuals are in steps of 2^stepBits units, 4 to 8. False if memory is out.
  [[nodiscard]] bool allocate(const StreamLayout& layout, int stepBits);

  const Hierarchy& hierarchy() const { return hierarchy_; }

  void begin(bool key);
  void predict(std::uint32_t slot, const FeatureVectors& weights, Prediction& out) const {
    FeatureVectors features;
    predict(slot, weights, features, out);
  }
  void predict(std::uint32_t slot, const FeatureVectors& weights, FeatureVectors& features,
               Prediction& out) const;
  // The position to which these residuals lead, in steps along u, v and n.
  Int32x4 reconstruct(const Prediction& prediction, const std::int32_t* residual) const;
  void place(std::uint32_t slot, const Prediction& prediction, Int32x4 position, std::uint32_t magnitudes);
  void keep();

  // Of the newest frame that was kept, in coding order.
  std::span<const Node> nodes() const { return {nodes_[1].data(), hierarchy_.vertexOf.size()}; }

 private:
  // The discrete Laplacian of the last frame, and of the one before: x x y y z z.
  struct alignas(16) Curvature {
    std::int16_t newAndOld[8] = {};
  };

  Int32x4 reconstructFar(const Prediction& prediction, const std::int32_t* residual) const;

  Hierarchy hierarchy_;
  int stepBits_ = 0, fineBits_ = 0;  // a sixteenth of a step is 2^fineBits_ units
  // [0] of the frame that is being made, then of those before.
  std::array<Array<Node>, 2> nodes_;
  std::array<Array<Record>, 4> records_;
  Array<Curvature> curvatures_;
  Array<std::uint32_t> magnitudes_;
  std::size_t depth_ = 0;  // frames that were kept since the last key frame and with it; at most 3

  // What predict() reads of the past: of a key frame one of each that is all zero, by a stride of 0.
  bool key_ = true;
  std::size_t stride_ = 0;
  const Node* pastNodes_ = nullptr;
  std::array<const Record*, 3> past_{};
  const Curvature* pastCurvatures_ = nullptr;
  const std::uint32_t* pastMagnitudes_ = nullptr;
};

inline void Predictor::predict(std::uint32_t slot, const FeatureVectors& weights, FeatureVectors& features,
                               Prediction& out) const {
  const Neighbours& neighbours = hierarchy_.neighbours[slot];
  const Node* nodes = nodes_[0].data();
  const Int32x4 p0 = nodes[neighbours.parents[0]].load(), p1 = nodes[neighbours.parents[1]].load();
  const Int32x4 p2 = nodes[neighbours.parents[2]].load(), p3 = nodes[neighbours.parents[3]].load();
  const Int32x4 first = p0 + p1, second = p2 + p3, sum = first + second;
  Int32x4 ringSum = nodes[neighbours.ring[0]].load();
  for (std::size_t i = 1; i < 8; ++i) ringSum = ringSum + nodes[neighbours.ring[i]].load();
  const Int32x4 average = (sum + Int32x4::all(2)).shiftedRight(2);
  out.average = average;
  out.parentMagnitudes = static_cast<std::uint32_t>(sum.fourth());
  out.ringMagnitudes = static_cast<std::uint32_t>(ringSum.fourth());
  out.frame = surfaceFrame(p1 - p0, p3 - p2);
  const Int32x4 ring = ((ringSum + Int32x4::all(4)).shiftedRight(3) - average).shiftedRight(fineBits_);
  const Int32x4 twist = (first - second).shiftedRight(2 + fineBits_);
  const Int16x8 twistRing = interleaveHalves(narrow(twist, ring));
  out.twistRing = twistRing;
  out.ring = interleave(Int16x8::zero(), narrow(ring, ring));

  const std::size_t at = slot * stride_;
  const Record &last = past_[0][at], &before = past_[1][at], &first3 = past_[2][at];
  out.lastMagnitudes = pastMagnitudes_[at];
  const Int32x4 average1 = Int32x4::load(last.average), average2 = Int32x4::load(before.average);
  const Int32x4 average3 = Int32x4::load(first3.average);
  const Int32x4 change0 = average - average1, change1 = average1 - average2, change2 = average2 - average3;
  const Int16x8 detail1 = Int16x8::load(last.detailAndRing), detail2 = Int16x8::load(before.detailAndRing);
  const Int16x8 detail3 = Int16x8::load(first3.detailAndRing);
  const Int16x8 local = Int16x8::load(last.local), localChange = local - Int16x8::load(before.local);
  const Int16x8 tangents = interleaveHalves(out.frame.tangents);
  const Int16x8 normal = interleave(out.frame.normal, Int16x8::zero());
  const auto turned = [&](Int16x8 detail) {
    const Int32x4 along = dotPairs(tangents, detail.broadcastPair<0>()).shiftedRight(kUnitBits);
    const Int32x4 across = dotPairs(normal, detail.broadcastPair<1>()).shiftedRight(kUnitBits);
    return interleaveHalves(narrow(along, across));
  };
  features = {detail1,
              detail1 - detail2,
              detail2 - detail3,
              twistRing - Int16x8::load(last.twistAndRing),
              Int16x8::load(pastCurvatures_[at].newAndOld),
              interleaveHalves(narrow((change0 - change1).shiftedRight(fineBits_),
                                      (change1 - change2).shiftedRight(fineBits_))),
              turned(local),
              turned(localChange)};
  // Sixteenths of a step in 2^-kWeightBits, to units; half a unit for the rounding.
  const int down = kWeightBits - fineBits_;
  Int32x4 change = Int32x4::all(1 << (down - 1));
  for (std::size_t i = 0; i < kFeaturePairs; ++i) change = change + dotPairs(features[i], weights[i]);
  // What rests is expected to go on resting: pins do, in the middle of a moving cloth.
  const Node& own = pastNodes_[at];
  out.last = own.load();
  out.position = own.rests() ? out.last : average + (out.last - average1) + change.shiftedRight(down);
}

inline Int32x4 Predictor::reconstruct(const Prediction& prediction, const std::int32_t* r) const {
  const auto fromLowest = [r](std::size_t c) { return static_cast<std::uint32_t>(r[c]) + 0x8000u; };
  if ((fromLowest(0) | fromLowest(1) | fromLowest(2)) >> 16 != 0) return reconstructFar(prediction, r);
  const Int32x4 moved = prediction.frame.combine(
      Int16x8::allPairs(static_cast<std::int16_t>(r[0]), static_cast<std::int16_t>(r[1])),
      Int16x8::allPairs(static_cast<std::int16_t>(r[2]), 0));
  const int down = kUnitBits - stepBits_;
  return prediction.position + (moved + Int32x4::all(1 << (down - 1))).shiftedRight(down);
}

inline void Predictor::place(std::uint32_t slot, const Prediction& prediction, Int32x4 position,
                             std::uint32_t magnitudes) {
  Node& node = nodes_[0][slot];
  position.store(&node.x);
  const bool rests = !key_ && position.sameThree(prediction.last);
  node.magnitudes = magnitudes | (rests ? 1u << 24 : 0u);
  const Int32x4 detail = (position - prediction.average).shiftedRight(fineBits_);
  const Int16x8 narrowed = narrow(detail, detail).withoutFourth();
  Record& record = records_[0][slot];
  prediction.average.store(record.average);
  evenAndOdd(interleave(narrowed, narrowed), prediction.ring).store(record.detailAndRing);
  prediction.twistRing.store(record.twistAndRing);
  const Int32x4 local = prediction.frame.project(narrowed).shiftedRight(kUnitBits);
  narrow(local, local).store(record.local);
}

}  // namespace clothstream::codec::hierarchical
