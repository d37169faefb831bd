// SPDX-License-Identifier: MIT
// Detects a scene that takes far more of the device's time than its price.
#pragma once

#include <algorithm>
#include <limits>

namespace clothstream::schedule {

// Not thread-safe.
class PriceWatch {
 public:
  // Ticks in a row that must each take kFactor times their price.
  static constexpr int kTicks = 5;
  static constexpr double kFactor = 10;
  // Shorter ticks harm no other scene, and a busy machine lengthens them by more than kFactor.
  static constexpr double kMinSeconds = 0.1;

  // Records a tick and its price, both in seconds. Returns true at every kTicks-th such tick in a row. The
  // device may then be slower than the price assumes, because other programs use the machine: measure its
  // speed, and call isExcessive().
  bool note(double seconds, double price) {
    const double factor = seconds / price;
    if (seconds < kMinSeconds || !(factor > kFactor)) {
      restart();
      return false;
    }
    leastFactor_ = std::min(leastFactor_, factor);
    return ++ticks_ % kTicks == 0;
  }

  // Returns whether each of these ticks took kFactor times its price on a device that is `slowdown` times as
  // slow as the price assumes. Otherwise counting starts again.
  bool isExcessive(double slowdown) {
    if (leastFactor_ > kFactor * std::max(1.0, slowdown)) return true;
    restart();
    return false;
  }

 private:
  void restart() {
    ticks_ = 0;
    leastFactor_ = std::numeric_limits<double>::infinity();
  }

  int ticks_ = 0;
  double leastFactor_ = std::numeric_limits<double>::infinity();
};

}  // namespace clothstream::schedule
