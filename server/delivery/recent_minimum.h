// SPDX-License-Identifier: MIT
// Lowest value of the last 30 seconds.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// Holds the minima of kSlots intervals, as RFC 6817, section 3.4.2, does: memory is constant, and a value
// counts for kHistory minus up to one interval. Not thread-safe.
class RecentMinimum {
 public:
  static constexpr std::size_t kSlots = 10;
  static constexpr std::chrono::seconds kHistory{30};

  RecentMinimum() { slots_.fill(kUnset); }

  void add(std::int64_t value, Clock::time_point now) {
    if (now - begin_ >= kHistory) {
      slots_.fill(kUnset);
      begin_ = now;
    }
    for (; now - begin_ >= kHistory / kSlots; begin_ += kHistory / kSlots) {
      current_ = (current_ + 1) % kSlots;
      slots_[current_] = kUnset;
    }
    slots_[current_] = std::min(slots_[current_], value);
  }
  // Only after the first add().
  std::int64_t value() const { return std::ranges::min(slots_); }

 private:
  static constexpr std::int64_t kUnset = std::numeric_limits<std::int64_t>::max();

  std::array<std::int64_t, kSlots> slots_{};
  std::size_t current_ = 0;
  Clock::time_point begin_{};  // of the current slot
};

}  // namespace clothstream::delivery
