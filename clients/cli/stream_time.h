// SPDX-License-Identifier: MIT
// How long a command follows a stream.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

namespace clothstream::cli {

// The time starts with the first frame, so that a server that has to load the scene first does not shorten
// it. If no frame arrives within a minute, it starts then.
class StreamTime {
 public:
  // Without `seconds`, the time has no end.
  explicit StreamTime(std::optional<double> seconds) : seconds_(seconds) {}

  // Returns `wait`, or less if the time ends before; nothing if the time is over. `frames` have arrived so
  // far.
  std::optional<std::chrono::milliseconds> next(std::chrono::milliseconds wait, std::uint64_t frames) {
    if (!seconds_) return wait;
    const auto now = Clock::now();
    if (!started_) start_ = now;
    started_ = started_ || frames > 0 || now - created_ >= kPatience;
    if (!started_) return std::min(wait, kPoll);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(std::chrono::duration<double>(*seconds_) -
                                                                   (now - start_));
    if (left.count() <= 0) return std::nullopt;
    return std::min(wait, left);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPatience{60};
  static constexpr std::chrono::milliseconds kPoll{5};

  std::optional<double> seconds_;
  Clock::time_point created_ = Clock::now(), start_ = created_;
  bool started_ = false;
};

}  // namespace clothstream::cli
