// SPDX-License-Identifier: MIT
// How long play-out waits before it shows a frame.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "clients/core/stream/server_clock.h"

namespace clothstream::client {

// The delay that all but the slowest 2 % of the newest frames needed, and at most the delay that the slowest
// frame of the last second needed. A rare stall is therefore ignored, stalls that recur are waited for, and
// one second after a disturbance the delay falls.
//
// The first frames are slow while a connection starts. Until there are kFirst of them, the delay is what half
// of them needed, and falls to it at once; then they are forgotten.
//
// Later it moves by at most kSlew of the time that passes, so that motion never jumps, and until there are
// kSettled frames by at most the whole of that time, so that motion never goes back. All times are
// microseconds.
class PlayOutDelay {
 public:
  static constexpr double kSlew = 0.1;

  PlayOutDelay() { sorted_.reserve(kSamples); }

  void forget() {
    forgetSamples();
    frames_ = 0;
  }
  // Whether a frame was sampled since forget().
  bool known() const { return frames_ > 0; }

  // Adds a frame that could be displayed at this time, `neededUs` after the start of the previous tick. With
  // this delay it arrives just when interpolation towards it starts.
  void sample(double neededUs, std::uint64_t atUs) {
    if (frames_++ == kFirst) forgetSamples();
    Sample& slot = samples_[count_ % kSamples];
    if (count_++ >= kSamples) sorted_.erase(std::lower_bound(sorted_.begin(), sorted_.end(), slot.neededUs));
    slot = {neededUs, atUs};
    sorted_.insert(std::upper_bound(sorted_.begin(), sorted_.end(), neededUs), neededUs);
    const double part = frames_ <= kFirst ? 0.5 : kPercentile;
    const auto at = static_cast<std::size_t>(part * static_cast<double>(sorted_.size() - 1));
    neededUs_ = std::min(sorted_[at], slowestSince(atUs));
  }

  void set(double us) { us_ = wantedUs_ = us; }
  // Moves towards what frames need for a request that comes `aheadUs` before its display time, because that
  // needs a longer delay. `elapsedUs` is the time since the last call; nullopt: the delay is set at once.
  void move(double aheadUs, std::optional<double> elapsedUs, double leastUs, double mostUs) {
    wantedUs_ = std::clamp(neededUs_ + aheadUs, leastUs, mostUs);
    const double most = (frames_ < kSettled ? 1 : kSlew) * elapsedUs.value_or(0);
    const bool falls = frames_ <= kFirst && wantedUs_ < us_;
    us_ = elapsedUs && !falls ? us_ + std::clamp(wantedUs_ - us_, -most, most) : wantedUs_;
  }
  double us() const { return us_; }
  double wantedUs() const { return wantedUs_; }

 private:
  static constexpr std::size_t kSamples = 2048;
  static constexpr std::size_t kFirst = 8, kSettled = 16;  // frames
  static constexpr double kPercentile = 0.98, kRecentUs = 1e6;

  struct Sample {
    double neededUs = 0;
    std::uint64_t atUs = 0;
  };

  void forgetSamples() {
    count_ = 0;
    sorted_.clear();
  }
  // Largest need of the last kRecentUs. Stops where times go back, because the clock has jumped.
  double slowestSince(std::uint64_t nowUs) const {
    double slowest = samples_[(count_ - 1) % kSamples].neededUs;
    for (std::size_t back = 1; back < sorted_.size(); ++back) {
      const Sample& sample = samples_[(count_ - 1 - back) % kSamples];
      const double ageUs = since(sample.atUs, nowUs);
      if (ageUs < 0 || ageUs > kRecentUs) break;
      slowest = std::max(slowest, sample.neededUs);
    }
    return slowest;
  }

  std::array<Sample, kSamples> samples_{};  // ring buffer
  std::vector<double> sorted_;              // needs of the samples in the ring
  std::size_t count_ = 0;                   // samples since forgetSamples(); the newest are kept
  std::size_t frames_ = 0;                  // since forget()
  double neededUs_ = 0;
  double us_ = 0, wantedUs_ = 0;
};

}  // namespace clothstream::client
