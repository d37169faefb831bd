// SPDX-License-Identifier: MIT
// When an edge tells an origin what it needs of a stream.
#pragma once

#include <chrono>

#include "server/delivery/published_frame.h"
#include "server/schedule/clock.h"

namespace clothstream::fleet {

// At once when more is needed or qualities change, and else about once a second.
class InterestTimes {
 public:
  using Clock = schedule::Clock;

  // Whether to tell what is needed now; then it counts as told. `asksOften`: key frames are asked for again
  // sooner.
  [[nodiscard]] bool update(const delivery::RequestedFrames& needed, bool asksOften, Clock::time_point now) {
    const bool more = needed.qualities != told_.qualities || (needed.keyFrames & ~told_.keyFrames) != 0;
    const bool again = asksOften && needed.keyFrames != 0;
    if (!more && now - toldAt_ < (again ? kKeyFramePeriod : kPeriod)) {
      told_.keyFrames &= needed.keyFrames;
      return false;
    }
    told_ = needed;
    toldAt_ = now;
    return true;
  }

 private:
  static constexpr std::chrono::milliseconds kPeriod{1000}, kKeyFramePeriod{100};

  delivery::RequestedFrames told_;
  Clock::time_point toldAt_{};
};

}  // namespace clothstream::fleet
