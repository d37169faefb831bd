// SPDX-License-Identifier: MIT
// Rate limit with a burst.
#pragma once

#include <algorithm>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Starts full. Not thread-safe.
class TokenBucket {
 public:
  TokenBucket(double perSecond, double burst) : perSecond_(perSecond), burst_(burst), tokens_(burst) {}

  // Takes `cost` tokens. Returns false, and takes nothing, if there are fewer.
  bool take(Clock::time_point now, double cost = 1) {
    if (now > last_) {
      if (last_ != Clock::time_point{})
        tokens_ = std::min(burst_, tokens_ + seconds(now - last_) * perSecond_);
      last_ = now;
    }
    if (tokens_ < cost) return false;
    tokens_ -= cost;
    return true;
  }

 private:
  double perSecond_, burst_, tokens_;
  Clock::time_point last_{};
};

}  // namespace clothstream::schedule
