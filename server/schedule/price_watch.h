// SPDX-License-Identifier: MIT
// Detects a scene that takes far more of the device's time than its price.
#pragma once

#include <algorithm>
#include <optional>

namespace clothstream::schedule {

// Counts the time beyond what the price allows, in seconds, so that one very long tick is enough. A tick is
// judged while it runs: after each of its slices, and at its end. Takes times as arguments. Not thread-safe.
class PriceWatch {
 public:
  // A tick may take kFactor times its price. Ticks below kMinSeconds harm no other scene, and a busy machine
  // lengthens them by more than kFactor.
  static constexpr double kFactor = 10, kMinSeconds = 0.1;
  // Seconds beyond what is allowed, over all ticks since the scene was last within it.
  static constexpr double kMostExcess = 1;
  // Seconds that one slice counts at most. The work of a slice is bounded, so that a longer one shows that
  // the machine stood still.
  static constexpr double kMostOfSlice = 0.25;

  // A tick with this price begins, in seconds. A tick that was not ended does not count any more.
  void begin(double price) {
    tick_ = 0;
    tickAllowed_ = std::max(kFactor * price, kMinSeconds);
  }

  // A slice of the tick took these seconds. Returns true if the excess is too large by now. The device may be
  // slower than the price assumes, because other programs use the machine: measure its speed, and call
  // isExcessive().
  bool addSlice(double seconds) {
    tick_ += std::min(seconds, kMostOfSlice);
    return isTooMuch();
  }

  // The tick has ended. `device`: seconds that the device worked on it, if that is known; the rest of its
  // slices was waiting. Returns the same.
  bool end(std::optional<double> device) {
    seconds_ += device ? std::min(*device, tick_) : tick_;
    allowed_ += tickAllowed_;
    tick_ = tickAllowed_ = 0;
    if (seconds_ <= allowed_) {
      seconds_ = allowed_ = 0;
      slowdown_ = 1;
    }
    return isTooMuch();
  }

  // Returns whether the excess is too large on a device that is `slowdown` times as slow as the price
  // assumes. Until the scene is within what is allowed, that is the measure: a later excess is reported
  // only when it is too large for such a device.
  bool isExcessive(double slowdown) {
    slowdown_ = std::max(1.0, slowdown);
    return isTooMuch();
  }

 private:
  bool isTooMuch() const { return seconds_ + tick_ - slowdown_ * (allowed_ + tickAllowed_) > kMostExcess; }

  double seconds_ = 0, allowed_ = 0;   // of complete ticks
  double tick_ = 0, tickAllowed_ = 0;  // of the present one
  double slowdown_ = 1;                // of the device, when it was measured last
};

}  // namespace clothstream::schedule
