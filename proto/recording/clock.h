// SPDX-License-Identifier: MIT
// Clock of a recording.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::recording {

// Nanoseconds since 1970. Starts with the time of day at construction and then follows the steady clock, so a
// change of the machine's time of day does not affect a recording. Thread-safe.
class RecordingClock {
 public:
  std::uint64_t now() const {
    const auto since = std::chrono::steady_clock::now() - steady_;
    return start_ +
           static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since).count());
  }

 private:
  const std::chrono::steady_clock::time_point steady_ = std::chrono::steady_clock::now();
  const std::uint64_t start_ =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(
                                     std::chrono::system_clock::now().time_since_epoch())
                                     .count());
};

}  // namespace clothstream::recording
