// SPDX-License-Identifier: MIT
// How long to wait for packets that others have overtaken.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "proto/datagram/datagram.h"

namespace clothstream::datagram {

// Learns from the numbers of packets how late they arrive after the first one that was sent later. The window
// is 0 on links that keep the order, grows at once when packets arrive late, and shrinks within some thousand
// packets, so that about one late packet in a hundred exceeds it. RFC 8985 section 6.2 adapts such a window,
// too.
class ReorderWindow {
 public:
  // Largest window.
  static constexpr double kMaxUs = 20'000;

  void add(std::uint32_t packet, std::uint64_t nowUs) {
    const std::int32_t ahead = steps(next_, packet);
    if (ahead >= 0) {
      if (ahead > 0) gaps_[gapCount_++ % gaps_.size()] = {next_, packet, nowUs};
      next_ = packet + 1;
      learn(0);
      return;
    }
    for (const Gap& gap : gaps_)
      if (packet - gap.first < gap.end - gap.first) learn(static_cast<double>(nowUs - gap.noticedUs));
  }

  std::uint64_t us() const { return static_cast<std::uint64_t>(windowUs_); }

 private:
  static constexpr double kGrowth = 1.0 / 4, kShrinking = 1.0 / 2048;

  // Numbers from `first` to before `end`, which had not arrived when `end` did.
  struct Gap {
    std::uint32_t first = 0, end = 0;
    std::uint64_t noticedUs = 0;
  };

  void learn(double lateUs) {
    const double difference = std::min(lateUs, kMaxUs) - windowUs_;
    windowUs_ += difference > 0 ? difference * kGrowth : -windowUs_ * kShrinking;
  }

  std::array<Gap, 16> gaps_;  // the newest ones
  std::size_t gapCount_ = 0;
  std::uint32_t next_ = 0;  // one after the newest packet
  double windowUs_ = 0;
};

}  // namespace clothstream::datagram
