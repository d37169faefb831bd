// SPDX-License-Identifier: MIT
// Number of parity rows for each frame of one peer.
#pragma once

#include <cstdint>
#include <optional>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// Losses of a path: their share, 0 to 1, and the mean number of packets that are lost in a row. Independent
// losses have 1 / (1 - share); lower values count as this.
struct PacketLoss {
  double share = 0;
  double burst = 1;
};

// A frame has k data rows and m parity rows, each in one packet, and any k of them suffice (maximum distance
// separable code). Returns the smallest m, at most `most`, with which the frame cannot be decoded with a
// probability of at most `residual`; nothing if no such m exists.
//
// The losses follow the two-state chain of Gilbert (1960). For independent losses this is the binomial
// formula: the sum over i > m of C(k + m, i) p^i (1 - p)^(k + m - i).
std::optional<std::uint32_t> rowsFor(const PacketLoss& loss, std::uint32_t k, double residual,
                                     std::uint32_t most);

// Follows the measured loss and gives the rows for a frame. A higher loss counts at once, a lower one when
// the measured one has been a third lower for kHold, so that the number of rows does not oscillate.
//
// Bursts that kMost rows cannot repair are left to repeats on request: such a frame gets the rows for
// independent losses of the same share.
//
// Not thread-safe. Takes its time as an argument.
class ParityPolicy {
 public:
  static constexpr std::uint32_t kMost = 4;
  // Residual losses of a frame that others refer to, and of one that no other frame refers to.
  static constexpr double kReferred = 3e-4, kUnreferred = 0.04;
  // Loss that is assumed at least: a thousand packets without a loss show no less.
  static constexpr double kLeastLoss = 1e-3;
  static constexpr std::chrono::seconds kHold{2};

  // The measured loss; shares above 0.5 count as 0.5. Call it with each receipt.
  void update(PacketLoss measured, Clock::time_point now);
  // Rows for a frame of k data rows, 1 to 128. `referred`: other frames are predicted from it. `least` and
  // `most`, at most kMost, bound the result.
  std::uint32_t rows(std::uint32_t k, bool referred, std::uint32_t least = 0,
                     std::uint32_t most = kMost) const;

 private:
  PacketLoss loss_{.share = kLeastLoss};
  std::optional<Clock::time_point> lowerSince_;
};

}  // namespace clothstream::delivery
