// SPDX-License-Identifier: MIT
// When the ticks of a scene are due.
#pragma once

#include <cstdint>

#include "server/stream/clock.h"

namespace clothstream::stream {

// Tick n after start() is due n periods later, counted in whole ticks so that no rounding adds up. A scene
// that is behind catches up at most one tick, and what it is given to spare: what it is behind more than that
// is given up, and simulated time falls behind real time. Not thread-safe.
class Pacer {
 public:
  explicit Pacer(std::uint32_t ticksPerSecond) : ticksPerSecond_(ticksPerSecond) {}

  // The next tick is due now.
  void start(Clock::time_point now) {
    origin_ = now;
    ticks_ = 0;
  }

  Clock::time_point due() const { return origin_ + periods(ticks_); }
  Clock::duration period() const { return periods(1); }

  struct Start {
    Clock::duration lateness{};  // behind what was due
    bool late = false;           // by more than a quarter of a period
    double slippedTicks = 0;     // of simulated time given up
  };

  // A tick starts; not before it is due.
  Start begin(Clock::time_point now, Clock::duration spare = {}) {
    Start start{.lateness = now - due()};
    start.late = start.lateness > period() / 4;
    const Clock::duration given = start.lateness - period() - spare;
    if (given > Clock::duration::zero()) {
      start.slippedTicks = seconds(given) * static_cast<double>(ticksPerSecond_);
      origin_ += given;
    }
    ++ticks_;
    return start;
  }

 private:
  Clock::duration periods(std::uint64_t count) const {
    // Whole seconds apart from the rest: nothing overflows in years.
    return std::chrono::seconds(count / ticksPerSecond_) +
           Clock::duration(
               std::chrono::nanoseconds(count % ticksPerSecond_ * 1'000'000'000 / ticksPerSecond_));
  }

  std::uint64_t ticksPerSecond_;
  Clock::time_point origin_{};
  std::uint64_t ticks_ = 0;
};

}  // namespace clothstream::stream
