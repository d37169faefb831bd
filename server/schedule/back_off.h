// SPDX-License-Identifier: MIT
// Pauses that grow while something fails again and again.
#pragma once

#include <algorithm>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// The first failure has no pause, the second one `least`, and each later one twice the pause before it, up to
// `most`. A time of `most` without a failure, after the pause, starts from the first one again. Not
// thread-safe.
class BackOff {
 public:
  BackOff(Clock::duration least, Clock::duration most) : least_(least), most_(most) {}

  // Returns the pause after a failure at this time.
  Clock::duration fail(Clock::time_point now) {
    if (fails_ && now >= until_ + most_) {
      fails_ = false;
      newest_ = {};
    }
    const Clock::duration pause = fails_ ? std::clamp(2 * newest_, least_, most_) : Clock::duration::zero();
    fails_ = true;
    newest_ = pause;
    until_ = now + pause;
    return pause;
  }

 private:
  const Clock::duration least_, most_;
  Clock::duration newest_{};
  bool fails_ = false;
  Clock::time_point until_{};  // end of the newest pause
};

}  // namespace clothstream::schedule
