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
// separable code). `apart` other packets leave between the data and the parity. Returns the smallest m, at
// most `most`, with which the frame cannot be decoded with a probability of at most `residual`; nothing if no
// such m exists.
//
// The losses follow the two-state chain of Gilbert (1960). For independent losses this is the binomial
// formula: the sum over i > m of C(k + m, i) p^i (1 - p)^(k + m - i).
std::optional<std::uint32_t> rowsFor(const PacketLoss& loss, std::uint32_t k, double residual,
                                     std::uint32_t most, std::uint32_t apart = 0);

// Follows the measured loss and gives the rows for a frame. A higher loss counts at once, a lower one when
// the measured one has been a third lower for kHold, so that the number of rows does not oscillate.
//
// Where losses come in bursts, a burst would take the parity together with the data. Parity then leaves after
// the data of the next frame, which costs a lost frame one frame interval. What kMost rows cannot repair is
// left to repeats on request.
//
// Not thread-safe. Takes its time as an argument.
class ParityPolicy {
 public:
  static constexpr std::uint32_t kMost = 4;
  // Probability at most that a frame cannot be decoded.
  static constexpr double kResidual = 3e-4;
  // Mean length from which losses count as bursts. Independent losses of 0.33 have it.
  static constexpr double kBurst = 1.5;
  // Loss that is assumed at least: a thousand packets without a loss show no less.
  static constexpr double kLeastLoss = 1e-3;
  static constexpr std::chrono::seconds kHold{2};

  // The measured loss; shares above 0.5 count as 0.5. Call it with each receipt.
  void update(PacketLoss measured, Clock::time_point now);
  // Whether parity leaves after the next frame.
  bool defers() const { return loss_.burst >= kBurst; }
  // Rows for a frame of k data rows, 1 to 128.
  std::uint32_t rows(std::uint32_t k) const;

 private:
  PacketLoss loss_{.share = kLeastLoss};
  std::optional<Clock::time_point> lowerSince_;
};

}  // namespace clothstream::delivery
