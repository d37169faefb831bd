// SPDX-License-Identifier: MIT
// Whether a scene's simulated time keeps up with real time.
#pragma once

#include <optional>

#include "server/stream/clock.h"

namespace clothstream::stream {

// Looks at stretches of two seconds, so that a single hiccup is none of its business, and speaks at most
// every ten. Not thread-safe.
class SlowWatch {
 public:
  static constexpr std::chrono::seconds kStretch{2}, kPause{10};
  static constexpr double kSlow = 0.95;

  void restart() { watching_ = false; }

  // A tick started, before which simulated time gave up so many ticks. Its speed in parts of real time, where
  // that is below kSlow and to be told.
  std::optional<double> note(Clock::time_point now, double slippedTicks) {
    if (!watching_) {
      watching_ = true;
      start_ = now;
      ticks_ = slipped_ = 0;
    }
    ticks_ += 1;
    slipped_ += slippedTicks;
    if (now - start_ < kStretch) return std::nullopt;
    watching_ = false;
    const double speed = ticks_ / (ticks_ + slipped_);
    if (speed >= kSlow || (told_ && now - *told_ < kPause)) return std::nullopt;
    told_ = now;
    return speed;
  }

 private:
  bool watching_ = false;
  Clock::time_point start_{};  // of the stretch, while watching
  std::optional<Clock::time_point> told_;
  double ticks_ = 0, slipped_ = 0;
};

}  // namespace clothstream::stream
