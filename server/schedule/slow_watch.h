// SPDX-License-Identifier: MIT
// Detects a scene whose simulated time does not keep up with real time.
#pragma once

#include <optional>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Measures intervals of kInterval, so that a single delay does not count. Reports at most once every kPause.
// Not thread-safe.
class SlowWatch {
 public:
  static constexpr std::chrono::seconds kInterval{2}, kPause{10};
  // Simulated seconds per real second below which a scene is slow.
  static constexpr double kSlow = 0.95;

  void restart() { watching_ = false; }

  // Records that a tick started and that simulated time slipped by `slippedTicks` before it. Returns the
  // speed of the interval, in simulated seconds per real second, if it is below kSlow and a report is due.
  std::optional<double> note(Clock::time_point now, double slippedTicks) {
    if (!watching_) {
      watching_ = true;
      start_ = now;
      ticks_ = slipped_ = 0;
    }
    ticks_ += 1;
    slipped_ += slippedTicks;
    if (now - start_ < kInterval) return std::nullopt;
    watching_ = false;
    const double speed = ticks_ / (ticks_ + slipped_);
    if (speed >= kSlow || (reported_ && now - *reported_ < kPause)) return std::nullopt;
    reported_ = now;
    return speed;
  }

 private:
  bool watching_ = false;
  Clock::time_point start_{};  // of the interval, while watching
  std::optional<Clock::time_point> reported_;
  double ticks_ = 0, slipped_ = 0;  // in the interval
};

}  // namespace clothstream::schedule
