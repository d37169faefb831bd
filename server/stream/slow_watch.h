// SPDX-License-Identifier: MIT
// Whether a scene's simulated time keeps up with real time.
#pragma once

#include <optional>

#include "server/stream/clock.h"

namespace clothstream::stream {

// Looks at stretches of two seconds, so that a single hiccup is none of its business, and speaks at most every ten.
// Not thread-safe.
class SlowWatch {
 public:
  static constexpr std::chrono::seconds kStretch{2}, kPause{10};
  static constexpr double kSlow = 0.99;

  void restart() { start_.reset(); }

  // A tick started, before which simulated time gave up so many ticks. Its speed in parts of real time, where that is
  // below kSlow and to be told.
  std::optional<double> note(Clock::time_point now, double slippedTicks) {
    if (!start_) {
      start_ = now;
      ticks_ = slipped_ = 0;
    }
    ticks_ += 1;
    slipped_ += slippedTicks;
    if (now - *start_ < kStretch) return std::nullopt;
    start_.reset();
    const double speed = ticks_ / (ticks_ + slipped_);
    if (speed >= kSlow || (told_ && now - *told_ < kPause)) return std::nullopt;
    told_ = now;
    return speed;
  }

 private:
  std::optional<Clock::time_point> start_, told_;
  double ticks_ = 0, slipped_ = 0;
};

}  // namespace clothstream::stream
