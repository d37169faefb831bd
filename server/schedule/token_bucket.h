// SPDX-License-Identifier: MIT
// Rate limit with a burst.
#pragma once

#include <algorithm>
#include <chrono>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Starts full. Not thread-safe.
class TokenBucket {
 public:
  constexpr TokenBucket(double perSecond, double burst)
      : perSecond_(perSecond), burst_(burst), tokens_(burst) {}

  // Takes `cost` tokens. Returns false, and takes nothing, if there are fewer.
  bool take(Clock::time_point now, double cost = 1) {
    refill(now);
    if (tokens_ < cost) return false;
    tokens_ -= cost;
    return true;
  }

  // Returns tokens that were taken.
  void giveBack(double cost = 1) { tokens_ = std::min(burst_, tokens_ + cost); }

  // Returns whether the bucket has all its tokens, like a new one.
  bool isFull(Clock::time_point now) {
    refill(now);
    return tokens_ >= burst_;
  }

  // Takes `cost` tokens, also if there are fewer. Returns the time until the missing ones are there, else 0.
  Clock::duration pay(Clock::time_point now, double cost) {
    refill(now);
    tokens_ -= cost;
    if (tokens_ >= 0) return {};
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(-tokens_ / perSecond_));
  }

 private:
  void refill(Clock::time_point now) {
    if (now <= last_) return;
    if (last_ != Clock::time_point{}) tokens_ = std::min(burst_, tokens_ + seconds(now - last_) * perSecond_);
    last_ = now;
  }

  double perSecond_, burst_, tokens_;
  Clock::time_point last_{};
};

}  // namespace clothstream::schedule
