// SPDX-License-Identifier: MIT
// Share of lost packets, and lengths of bursts of losses.
#pragma once

#include <algorithm>

namespace clothstream::delivery {

// Averages over about the last kPackets packets. Not thread-safe.
class LossMeter {
 public:
  static constexpr double kPackets = 1024;

  // Records the fates of the packets, in the order of their numbers.
  void add(bool lost) {
    constexpr double kKept = 1 - 1 / kPackets;
    packets_ = kKept * packets_ + 1;
    lost_ = kKept * lost_ + (lost ? 1 : 0);
    bursts_ = kKept * bursts_ + (lost && !lostBefore_ ? 1 : 0);
    lostBefore_ = lost;
  }

  // 0 to 1. Starts at 0.
  double share() const { return packets_ > 0 ? lost_ / packets_ : 0; }
  // Mean number of packets that are lost in a row, at least 1. Independent losses of share p have
  // 1 / (1 - p).
  double burst() const { return bursts_ > 0 ? std::max(lost_ / bursts_, 1.0) : 1; }

 private:
  double packets_ = 0, lost_ = 0, bursts_ = 0;
  bool lostBefore_ = false;
};

}  // namespace clothstream::delivery
