// SPDX-License-Identifier: MIT
// How often something may happen: a rate, and a burst above it.
#pragma once

#include <algorithm>

#include "server/stream/clock.h"

namespace clothstream::stream {

// Not thread-safe. Full at first.
class TokenBucket {
 public:
  TokenBucket(double perSecond, double burst) : perSecond_(perSecond), burst_(burst), tokens_(burst) {}

  // False, and nothing taken, where there are fewer than `cost` tokens.
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

}  // namespace clothstream::stream
