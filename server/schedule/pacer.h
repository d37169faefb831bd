// SPDX-License-Identifier: MIT
// Due times of a scene's ticks.
#pragma once

#include <cstdint>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Tick n is due n periods after start(). Periods are counted in whole ticks, so that rounding errors do not
// add up. A scene that is late catches up one tick at most, plus the `catchUp` that begin() allows. The rest
// of the lateness slips: simulated time falls behind real time by that much. Not thread-safe.
class Pacer {
 public:
  explicit Pacer(std::uint32_t ticksPerSecond) : ticksPerSecond_(ticksPerSecond) {}

  // Makes the next tick due at `now`.
  void start(Clock::time_point now) {
    origin_ = now;
    ticks_ = 0;
  }

  Clock::time_point due() const { return origin_ + periods(ticks_); }
  Clock::duration period() const { return periods(1); }

  struct Start {
    Clock::duration lateness{};  // from the due time to the start
    bool late = false;           // lateness is more than a quarter of a period
    double slippedTicks = 0;     // ticks by which simulated time fell behind at this start
  };

  // Starts a tick. `now` must not be before due().
  Start begin(Clock::time_point now, Clock::duration catchUp = {}) {
    Start start{.lateness = now - due()};
    start.late = start.lateness > period() / 4;
    const Clock::duration slipped = start.lateness - period() - catchUp;
    if (slipped > Clock::duration::zero()) {
      start.slippedTicks = seconds(slipped) * static_cast<double>(ticksPerSecond_);
      origin_ += slipped;
    }
    ++ticks_;
    return start;
  }

 private:
  Clock::duration periods(std::uint64_t count) const {
    // Whole seconds are added separately, so that the product cannot overflow.
    return std::chrono::seconds(count / ticksPerSecond_) +
           Clock::duration(
               std::chrono::nanoseconds(count % ticksPerSecond_ * 1'000'000'000 / ticksPerSecond_));
  }

  std::uint64_t ticksPerSecond_;
  Clock::time_point origin_{};
  std::uint64_t ticks_ = 0;
};

}  // namespace clothstream::schedule
