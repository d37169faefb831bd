// SPDX-License-Identifier: MIT
// When positions of a played recording are due.
#pragma once

#include <chrono>

#include "server/schedule/clock.h"

namespace clothstream::recording {

// Positions in seconds, speed in recorded seconds per second.
class Pace {
 public:
  using Clock = schedule::Clock;

  // From now on: the position is due now, and later ones in relation to it.
  void start(double position, Clock::time_point now) {
    originPosition_ = position;
    origin_ = now;
  }
  Clock::time_point due(double position, double speed) const {
    const std::chrono::duration<double> after((position - originPosition_) / speed);
    return origin_ + std::chrono::duration_cast<Clock::duration>(after);
  }
  // Whether the position is due. Delays of more than kMaxLateness are not caught up: they move what follows.
  bool reaches(double position, double speed, Clock::time_point now) {
    const Clock::time_point dueAt = due(position, speed);
    if (dueAt > now) return false;
    if (now - dueAt > kMaxLateness) origin_ += now - dueAt - kMaxLateness;
    return true;
  }

 private:
  static constexpr std::chrono::milliseconds kMaxLateness{250};

  Clock::time_point origin_{};
  double originPosition_ = 0;
};

}  // namespace clothstream::recording
