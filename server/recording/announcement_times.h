// SPDX-License-Identifier: MIT
// When a playback announces its position.
#pragma once

#include <chrono>
#include <cmath>

#include "server/schedule/clock.h"

namespace clothstream::recording {

// At once after a change, and then about once a second of time or, in lockstep, of the recording.
class AnnouncementTimes {
 public:
  using Clock = schedule::Clock;

  explicit AnnouncementTimes(bool lockstep) : lockstep_(lockstep) {}

  // Something has changed that must be announced.
  void request() { requested_ = true; }
  // `position` is in seconds. `flows`: the position changes.
  bool isDue(double position, bool flows, Clock::time_point now) const {
    if (requested_) return true;
    return flows && (lockstep_ ? std::floor(position) != std::floor(position_) : now >= next_);
  }
  void announced(double position, Clock::time_point now) {
    requested_ = false;
    position_ = position;
    next_ = now + std::chrono::seconds(1);
  }

 private:
  const bool lockstep_;
  bool requested_ = false;
  double position_ = 0;  // of the newest announcement, s
  Clock::time_point next_{};
};

}  // namespace clothstream::recording
