// SPDX-License-Identifier: MIT
// Server's steady clock, and its times in the units of the wire.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::schedule {

using Clock = std::chrono::steady_clock;

// Microseconds since the clock's epoch; the unit of all times in messages.
inline std::uint64_t microseconds(Clock::time_point time) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count());
}

inline double seconds(Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace clothstream::schedule
