// SPDX-License-Identifier: MIT
// Plan of the weights: when new ones are due, which frames they are fitted to, and how they are sent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/weight_fitter.h"

namespace clothstream::codec::hierarchical {

// The calls for a frame are begin(), write(), add() for the chunks that weights are fitted to, and end().
// Without a lag the weights of a frame are fitted to everything that was added before; those of a key frame
// to everything added between retry() and write(). With a lag they are fitted to the frames that are at least
// `lag` frames older, and those of a key frame to the last such key frame. A caller that prepares frames
// ahead then knows the weights before the frames in between are coded.
class WeightPlan {
 public:
  WeightPlan(const Hierarchy& hierarchy, std::uint32_t lag);

  static constexpr std::size_t kMaxBytes = kWeightClasses * kFeatures * 4;

  void begin(bool key);
  // True if a key frame is attempted once before it is coded. Only without a lag.
  bool attempts() const { return lag_ == 0; }
  void retry();
  // Writes the packet's first section, at most kMaxBytes, and returns its size. After it, used() is the
  // weights that the frame predicts with. A frame at rest leaves the weights that it started with.
  std::size_t write(bool atRest, std::byte* out);
  const Weights& used() const { return used_; }
  void add(std::uint32_t weightClass, const ChunkProducts& products) { fitter_.add(weightClass, products); }
  // `quiet`: the frame had no residuals.
  void end(bool quiet);

  // Requires a lag. Weights of frame `number` (counted from 0 since construction), which is `sinceKey` frames
  // after its key frame. Null if it keeps the weights that its reference left. May be called by any thread
  // that knows that the frame `lag` before it has ended and the next one has not.
  const Weights* planned(std::uint64_t number, std::uint32_t sinceKey) const;

 private:
  struct Planned {
    Weights weights, keyWeights;
    bool isDue = false;
  };

  bool isDue(std::uint32_t sinceKey, bool quiet) const;
  void writeChanges(const Weights& next, BitWriter& writer);
  Weights fitted();
  void plan(bool quiet);

  std::uint32_t lag_;
  std::array<std::uint32_t, kWeightClasses + 1> classSizes_{};
  WeightFitter fitter_;
  Weights beforeKey_{};       // left by the frame before the key frame
  Weights weights_;           // left by this frame
  Weights used_{};            // used in this frame
  std::uint64_t number_ = 0;  // number of this frame
  std::uint32_t sinceKey_ = 0;
  bool key_ = true, quiet_ = false;
  Weights keyWeights_;
  std::vector<Planned> planned_;  // indexed by number modulo the size
};

}  // namespace clothstream::codec::hierarchical
