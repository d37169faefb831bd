// SPDX-License-Identifier: MIT
// Prediction of a vertex in codec 2: from the vertices coded before it in this frame, and from the motion of
// all of them in earlier frames. Both ends compute the same integers.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/hierarchical/simd.h"
#include "proto/codec/hierarchical/surface_frame.h"

namespace clothstream::codec::hierarchical {

// Limit of |x|, |y| and |z| of a position in units. Sums of eight stay within 32 bits.
inline constexpr std::int32_t kMaxCoordinate = 1 << 27;
// Limit of a residual's magnitude where it estimates other residuals. Eight sums fit a byte.
inline constexpr std::uint32_t kMaxMagnitude = 31;

// Position of a vertex in units. In `magnitudes` the lowest byte is the magnitude of the residual along u, at
// most kMaxMagnitude; the next two bytes are those along v and n. They are loaded and added together with the
// position. The highest byte is 1 if the vertex rests: it is exactly where it was in the previous frame.
struct alignas(16) Node {
  std::int32_t x = 0, y = 0, z = 0;
  std::uint32_t magnitudes = 0;

  Int32x4 load() const { return Int32x4::load(&x); }
  bool rests() const { return magnitudes >> 24 != 0; }
};

// State of a vertex that later frames need. The previous frame is the reference of this one. Before a key
// frame everything counts as resting. 16-bit vectors are in sixteenths of a step, saturated.
struct alignas(64) Record {
  std::int32_t average[3];  // mean of the parents
  // magnitudes of the residuals: four times this vertex's plus those of the nearest vertices
  std::uint32_t magnitudes;
  std::int16_t curvatures[8];  // discrete Laplacian, and that of the previous frame: x x y y z z
  // half the difference of the two pairs of parents; mean of the ring minus average
  std::int16_t twistAndRing[8];
  std::int16_t detailAndRing[8];   // vertex minus average, and mean of the ring minus average: x x y y z z
  std::int16_t change[8];          // change of these two since the previous frame
  std::int16_t changeBefore[8];    // the same change in the previous frame
  std::int16_t movedAndFaster[8];  // average minus that of the previous frame; change of this difference
  std::int16_t local[8];           // detail along u, v and n, and that of the previous frame: u u v v n n
};

// Features that predict a change, and their weights: vectors in sixteenths of a step, interleaved in pairs.
inline constexpr std::size_t kFeaturePairs = 8;
inline constexpr std::size_t kFeatures = 2 * kFeaturePairs;
inline constexpr std::size_t kDetailChangeFeature = 2, kTwistFeature = 6, kRingFeature = 7;
using FeatureVectors = std::array<Int16x8, kFeaturePairs>;

// Plain features come first. The others are turned with the surface, and their sum has kTurnedBits more
// fraction bits.
inline constexpr std::size_t kPlainPairs = 6;
inline constexpr int kTurnedBits = 2;

// 2^kWeightBits stands for a weight of 1.
inline constexpr int kWeightBits = 10;
inline constexpr std::int32_t kMaxWeight = 2047;
// The last class is that of the corners, which has no weights.
using Weights = std::array<std::array<std::int16_t, kFeatures>, kWeightClasses + 1>;

// Weights of a class, laid out like the features that they multiply.
struct WeightVectors {
  std::array<Int16x8, kPlainPairs> plain;
  Int16x8 local;  // for `local` of a record
};

// Prediction of a vertex, before its residual is known.
struct Prediction {
  Int32x4 position, average;
  Int32x4 last;  // position in the previous frame; undefined in a key frame
  SurfaceFrame frame;
  Int16x8 twistAndRing, movedAndFaster;  // same as in the record
  // Sums of magnitudes: over the parents; over the ring; and of the previous frame, four times this vertex's
  // plus those of the nearest vertices.
  std::uint32_t parentMagnitudes, ringMagnitudes, lastMagnitudes;
};

// Vertices that are predicted before the first of them is coded: few enough for the first-level cache.
inline constexpr std::uint32_t kChunk = 64;
static_assert(kChunk % 8 == 0);  // eight are predicted at a time

// The calls for a frame are begin(); predict() and place() for all vertices in coding order; keep(). Without
// keep() the frame is discarded.
class Predictor {
 public:
  // Residuals are in steps of 2^stepBits units, with stepBits from 4 to 8. False if memory is out.
  [[nodiscard]] bool allocate(const StreamLayout& layout, int stepBits);

  // Takes effect at the next key frame.
  void setStepBits(int stepBits) { stepBits_ = stepBits; }

  const Hierarchy& hierarchy() const { return hierarchy_; }

  // A predicted frame refers to the newest frame that was kept.
  void begin(bool key);
  // Predicts up to kChunk vertices, none of which is a parent of another or in its ring. `out` and `frames`
  // have room for a multiple of eight vertices.
  void predict(std::uint32_t begin, std::uint32_t count, const WeightVectors& weights, Prediction* out,
               SurfaceFrames* frames) const;
  // Features that the weights multiplied; the turned ones have kTurnedBits fraction bits.
  FeatureVectors features(std::uint32_t slot, const Prediction& prediction) const;
  // Displacement of four vertices in units, for residuals in steps along u, v and n. Each residual fits 16
  // bits.
  Vectors4 moved(const SurfaceFrames& frames, const Vectors4& residuals) const;
  // Position of a vertex for residuals of any size.
  Int32x4 reconstruct(const Prediction& prediction, const std::int32_t* residual) const;
  // Places up to four consecutive vertices.
  void place(std::uint32_t begin, std::uint32_t count, const Prediction* predictions,
             const std::array<Int32x4, 4>& positions, Int32x4 magnitudes);
  // Replaces predict() and place() for vertices without residuals: interpolates them from this frame alone.
  void interpolate(std::uint32_t begin, std::uint32_t end);
  // Makes the frame the newest one. Only the first `slots` slots are kept; nothing may refer to the others.
  void keep(std::size_t slots);
  void keep() { keep(hierarchy_.vertexOf.size()); }

  // Nodes in coding order: of the newest frame that was kept; of the frame that is being made; and of its
  // reference (undefined in a key frame).
  std::span<const Node> nodes() const { return {newest_.nodes.data(), hierarchy_.vertexOf.size()}; }
  std::span<const Node> made() const { return {work_.nodes, hierarchy_.vertexOf.size()}; }
  std::span<const Node> reference() const { return {work_.pastNodes, hierarchy_.vertexOf.size()}; }

 private:
  // Everything that a frame is made from and into. Functions that store vectors work on a copy, because a
  // compiler must assume that a stored vector could overwrite members.
  struct Work {
    bool key = true;
    int fineBits = 0;  // 2^fineBits units are a sixteenth of a step
    // Past nodes and records. For a key frame these are a single zero node and record, read with a stride of
    // 0.
    std::size_t stride = 0;
    const Node* pastNodes = nullptr;
    const Record* pastRecords = nullptr;
    const Neighbours* neighbours = nullptr;
    Node* nodes = nullptr;
    Record* records = nullptr;

    struct Surroundings {
      std::array<Int32x4, 4> parents;
      Int32x4 parentSum, average, ringSum;
    };
    Surroundings surroundingsOf(std::uint32_t slot) const;
    void look(std::uint32_t slot, Prediction& out, Int32x4& first, Int32x4& second) const;
    void place(std::uint32_t slot, const Prediction& prediction, Int32x4 position,
               std::uint32_t magnitudes) const;
  };
  static std::array<Int16x8, kPlainPairs> plainFeatures(const Record& past, const Prediction& prediction);

  Hierarchy hierarchy_;
  int stepBits_ = 0;
  // State that a frame leaves.
  struct Moment {
    Array<Node> nodes;
    Array<Record> records;
  };
  Moment newest_, made_;  // of the newest frame that was kept, and of the frame that is being made
  Work work_;
};

// With equal weights this equals the mean of the four.
inline Int32x4 weightedAverage(const std::array<std::int16_t, 4>& weights, Int32x4 p0, Int32x4 p1, Int32x4 p2,
                               Int32x4 p3) {
  const Int32x4 sum = (p1 - p0) * weights[1] + (p2 - p0) * weights[2] + (p3 - p0) * weights[3];
  return p0 + (sum + Int32x4::all(1 << (kParentBits - 1))).shiftedRight(kParentBits);
}

inline Predictor::Work::Surroundings Predictor::Work::surroundingsOf(std::uint32_t slot) const {
  const auto& [parents, ring, weights] = neighbours[slot];
  const Int32x4 p0 = nodes[parents[0]].load(), p1 = nodes[parents[1]].load();
  const Int32x4 p2 = nodes[parents[2]].load(), p3 = nodes[parents[3]].load();
  const Int32x4 sum = (p0 + p1) + (p2 + p3);
  Int32x4 ringSum = nodes[ring[0]].load();
  for (std::size_t i = 1; i < 8; ++i) ringSum = ringSum + nodes[ring[i]].load();
  // True for all vertices of a grid except those at borders.
  const bool isEven = weights == kEqualWeights;
  const Int32x4 average =
      isEven ? (sum + Int32x4::all(2)).shiftedRight(2) : weightedAverage(weights, p0, p1, p2, p3);
  return {{p0, p1, p2, p3}, sum, average, ringSum};
}

// Computes all of a prediction except the frame and what follows from it. `first` and `second` span the
// surface.
inline void Predictor::Work::look(std::uint32_t slot, Prediction& out, Int32x4& first,
                                  Int32x4& second) const {
  const Surroundings around = surroundingsOf(slot);
  const auto& [p0, p1, p2, p3] = around.parents;
  const Int32x4 average = around.average;
  out.average = average;
  out.parentMagnitudes = static_cast<std::uint32_t>(around.parentSum.fourth());
  out.ringMagnitudes = static_cast<std::uint32_t>(around.ringSum.fourth());
  first = p1 - p0;
  second = p3 - p2;
  const Int32x4 ring = ((around.ringSum + Int32x4::all(4)).shiftedRight(3) - average).shiftedRight(fineBits);
  const Int32x4 twist = ((p0 + p1) - (p2 + p3)).shiftedRight(2 + fineBits);
  out.twistAndRing = narrow(twist, ring);

  const Record& past = pastRecords[slot * stride];
  out.lastMagnitudes = past.magnitudes;
  // Nothing moves in a key frame.
  const Int32x4 before = key ? average : Int32x4::load(past.average);
  const Int32x4 moved = (average - before).shiftedRight(fineBits);
  const Int16x8 narrowed = narrow(moved, moved);
  out.movedAndFaster = interleave64Low(narrowed, narrowed - Int16x8::load(past.movedAndFaster));
}

inline std::array<Int16x8, kPlainPairs> Predictor::plainFeatures(const Record& past, const Prediction& p) {
  return {Int16x8::load(past.detailAndRing),
          Int16x8::load(past.change),
          Int16x8::load(past.changeBefore),
          interleaveHalves(p.twistAndRing - Int16x8::load(past.twistAndRing)),
          Int16x8::load(past.curvatures),
          interleaveUpper(p.movedAndFaster, Int16x8::load(past.movedAndFaster))};
}

inline void Predictor::predict(std::uint32_t begin, std::uint32_t count, const WeightVectors& weights,
                               Prediction* out, SurfaceFrames* frames) const {
  const Work work = work_;
  for (std::uint32_t eight = 0; eight < count; eight += 8) {
    std::array<std::array<Int32x4, 4>, 2> first, second;
    for (std::uint32_t i = 0; i < 8; ++i)
      work.look(begin + std::min(eight + i, count - 1), out[eight + i], first[i / 4][i % 4],
                second[i / 4][i % 4]);
    const std::array<SurfaceFrames, 2> made = surfaceFrames(
        both(transposed(first[0]), transposed(first[1])), both(transposed(second[0]), transposed(second[1])));
    frames[eight / 4] = made[0];
    frames[eight / 4 + 1] = made[1];
  }
  // Bits from sixteenths of a step with kWeightBits fraction bits to units. The sum starts at half a unit,
  // for rounding.
  const int down = kWeightBits - work.fineBits;
  for (std::uint32_t four = 0; four < count; four += 4) {
    const std::array<SurfaceFrame, 4> split = frames[four / 4].split();
    for (std::uint32_t i = 0; i < 4; ++i) {
      Prediction& p = out[four + i];
      p.frame = split[i];
      const std::size_t at = (begin + std::min(four + i, count - 1)) * work.stride;
      const Record& past = work.pastRecords[at];
      const std::array<Int16x8, kPlainPairs> plain = plainFeatures(past, p);
      Int32x4 change = Int32x4::all(1 << (down - 1));
      for (std::size_t f = 0; f < kPlainPairs; ++f) change = change + dotPairs(plain[f], weights.plain[f]);
      const Int32x4 local = (dotPairs(Int16x8::load(past.local), weights.local) +
                             Int32x4::all(1 << (kWeightBits - kTurnedBits - 1)))
                                .shiftedRight(kWeightBits - kTurnedBits);
      const Int16x8 wished = narrow(local, local);
      const Int32x4 turned = p.frame.combine(wished.broadcastPair<0>(), wished.broadcastPair<1>());
      change = change + turned.shiftedRight(kUnitBits + kTurnedBits - kWeightBits);
      const Node& own = work.pastNodes[at];
      p.last = own.load();
      // A resting vertex is expected to go on resting, for example a pin in moving cloth.
      p.position = own.rests()
                       ? p.last
                       : p.average + (p.last - Int32x4::load(past.average)) + change.shiftedRight(down);
    }
  }
}

// Sets all bits of a lane if a component does not fit 16 bits.
inline Int32x4 beyond16Bits(const Vectors4& a) {
  const auto beyond = [](Int32x4 c) { return c.shiftedLeft(16).shiftedRight(16) == c; };
  return Int32x4::without(beyond(a.x) & beyond(a.y) & beyond(a.z), Int32x4::all(-1));
}

inline Vectors4 Predictor::moved(const SurfaceFrames& f, const Vectors4& residuals) const {
  const Int16x8 alongUv = pairs(residuals.x, residuals.y), alongN = pairs(residuals.z);
  const int down = kUnitBits - stepBits_;
  const auto component = [&](Int32x4 u, Int32x4 v, Int32x4 n) {
    const Int32x4 sum = dotPairs(pairs(u, v), alongUv) + dotPairs(Int16x8{n.v}, alongN);
    return (sum + Int32x4::all(1 << (down - 1))).shiftedRight(down);
  };
  return {component(f.u.x, f.v.x, f.n.x), component(f.u.y, f.v.y, f.n.y), component(f.u.z, f.v.z, f.n.z)};
}

inline void Predictor::Work::place(std::uint32_t slot, const Prediction& prediction, Int32x4 position,
                                   std::uint32_t magnitudes) const {
  Node& node = nodes[slot];
  position.store(&node.x);
  const bool rests = !key && position.sameThree(prediction.last);
  node.magnitudes = magnitudes | (rests ? 1u << 24 : 0u);
  const Int32x4 detail = (position - prediction.average).shiftedRight(fineBits);
  const Int16x8 narrowed = narrow(detail, detail).withoutFourth();
  const Int32x4 local32 = prediction.frame.project(narrowed).shiftedRight(kUnitBits);
  const Int16x8 local = narrow(local32, local32);
  const Int16x8 detailAndRing =
      interleave(narrowed, interleave64High(prediction.twistAndRing, prediction.twistAndRing));
  const Record& past = pastRecords[slot * stride];
  Record& record = records[slot];
  prediction.average.store(record.average);  // also writes the lane that keep() fills
  prediction.twistAndRing.store(record.twistAndRing);
  prediction.movedAndFaster.store(record.movedAndFaster);
  detailAndRing.store(record.detailAndRing);
  Int16x8::load(past.change).store(record.changeBefore);
  Int16x8::load(past.curvatures).store(record.curvatures);
  if (key) {
    // Everything counts as resting before a key frame.
    Int16x8::zero().store(record.change);
    interleave(local, local).store(record.local);
  } else {
    (detailAndRing - Int16x8::load(past.detailAndRing)).store(record.change);
    evenAndOdd(interleave(local, local), Int16x8::load(past.local).evenToOdd()).store(record.local);
  }
}

inline void Predictor::place(std::uint32_t begin, std::uint32_t count, const Prediction* predictions,
                             const std::array<Int32x4, 4>& positions, Int32x4 magnitudes) {
  const Work work = work_;
  alignas(16) std::int32_t m[4];
  magnitudes.store(m);
  for (std::uint32_t i = 0; i < count; ++i)
    work.place(begin + i, predictions[i], positions[i], static_cast<std::uint32_t>(m[i]));
}

}  // namespace clothstream::codec::hierarchical
