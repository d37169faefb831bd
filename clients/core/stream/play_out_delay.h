// SPDX-License-Identifier: MIT
// How long play-out waits before it shows a frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

namespace clothstream::client {

// The delay that all but the slowest 2 % of the newest frames needed. It moves by at most kSlew of the time
// that passes, so that motion never jumps. All times are microseconds.
class PlayOutDelay {
 public:
  void forget() { count_ = 0; }
  // Whether a frame was sampled since forget().
  bool known() const { return count_ > 0; }

  // Adds the time from the start of the previous tick until a frame could be displayed. With this delay the
  // frame arrives just when interpolation towards it starts.
  void sample(double neededUs) {
    samples_[count_++ % kSamples] = neededUs;
    const std::size_t count = std::min(count_, kSamples);
    const auto first = sorted_.begin(), last = first + static_cast<std::ptrdiff_t>(count);
    std::copy_n(samples_.begin(), count, first);
    const auto at = first + static_cast<std::ptrdiff_t>(kPercentile * static_cast<double>(count - 1));
    std::nth_element(first, at, last);
    neededUs_ = *at;
  }

  void set(double us) { us_ = wantedUs_ = us; }
  // Moves towards what frames need for a request that comes `aheadUs` before its display time, because that
  // needs a longer delay. `elapsedUs` is the time since the last call; nullopt: the delay is set at once.
  void move(double aheadUs, std::optional<double> elapsedUs, double leastUs, double mostUs) {
    wantedUs_ = std::clamp(neededUs_ + aheadUs, leastUs, mostUs);
    const double most = kSlew * elapsedUs.value_or(0);
    us_ = elapsedUs ? us_ + std::clamp(wantedUs_ - us_, -most, most) : wantedUs_;
  }
  double us() const { return us_; }
  double wantedUs() const { return wantedUs_; }

 private:
  static constexpr std::size_t kSamples = 256;
  static constexpr double kPercentile = 0.98, kSlew = 0.05;

  std::array<double, kSamples> samples_{}, sorted_{};
  std::size_t count_ = 0;  // samples so far; the newest are kept
  double neededUs_ = 0;
  double us_ = 0, wantedUs_ = 0;
};

}  // namespace clothstream::client
