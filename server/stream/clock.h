// SPDX-License-Identifier: MIT
// The server's steady clock, as it is spoken of on the wire.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::stream {

using Clock = std::chrono::steady_clock;

inline std::uint64_t microseconds(Clock::time_point time) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count());
}

inline double seconds(Clock::duration duration) {
  return std::chrono::duration<double>(duration).count();
}

}  // namespace clothstream::stream
