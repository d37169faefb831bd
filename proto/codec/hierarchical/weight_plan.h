// SPDX-License-Identifier: MIT
// Which weights a frame predicts with: when new ones are due, what they are fitted to, and how they are sent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/codec/frame_role.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/weight_fitter.h"

namespace clothstream::codec::hierarchical {

// A frame is begin(), write(), add() for the chunks that are fitted to, and end().
//
// Without a lag a frame's weights are fitted to all that was added before, a key frame's to what was added
// between retry() and write(). With one they are fitted to the frames that are so many or more before it (a
// key frame's to the last such key frame): who prepares frames knows them before those in between are coded.
// There is one temporal layer then.
class WeightPlan {
 public:
  WeightPlan(const Hierarchy& hierarchy, std::uint8_t layers, std::uint32_t lag);

  static constexpr std::size_t kMaxBytes = kMaxTemporalLayers * kWeightClasses * kFeatures * 4;

  void begin(const FrameRole& role);
  // A key frame is attempted once before it is coded: only without a lag.
  bool attempts() const { return lag_ == 0; }
  void retry();
  // The packet's first section, at most kMaxBytes; returns its bytes. used() is then what the frame predicts
  // with; at rest it leaves what it started with.
  std::size_t write(bool atRest, std::byte* out);
  const Weights& used() const { return used_; }
  void add(std::uint32_t weightClass, const ChunkProducts& products) {
    fitters_[layer_].add(weightClass, products);
  }
  // `quiet`: the frame had no residuals.
  void end(bool quiet);

  // With a lag: the weights of the frame of this number (of all that were begun, from 0) that is so many
  // after its key frame; null: those that its reference left. For any thread that knows that the frame `lag`
  // before it has ended and the one after it has not.
  const Weights* planned(std::uint64_t number, std::uint32_t sinceKey) const;

 private:
  struct Planned {
    Weights weights, keyWeights;
    bool isDue = false;
  };

  bool isDue(std::uint32_t sinceKey, bool quiet) const;
  void writeChanges(std::size_t of, const Weights& next, BitWriter& writer);
  Weights next(std::size_t of);
  Weights fitted(std::size_t of);
  void plan(bool quiet);

  std::uint32_t lag_;
  std::uint8_t layers_;
  std::array<std::uint32_t, kWeightClasses + 1> classSizes_{};
  std::vector<WeightFitter> fitters_;                    // by layer
  std::array<LayerWeights, kMaxTemporalLayers> kept_{};  // that the newest frame of each layer left
  Weights beforeKey_{};                                  // that the frame before the key frame left
  LayerWeights weights_{};                               // that this one leaves
  Weights used_{};                                       // in this frame
  std::uint64_t number_ = 0;                             // of this frame
  std::uint32_t sinceKey_ = 0;
  bool key_ = true, quiet_ = false;
  std::uint8_t layer_ = 0;
  Weights keyWeights_;
  std::vector<Planned> planned_;  // by number, modulo their number
};

}  // namespace clothstream::codec::hierarchical
