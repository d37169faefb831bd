// SPDX-License-Identifier: MIT
// Limits the time that changes of a scene take.
#pragma once

#include "server/schedule/clock.h"
#include "server/schedule/token_bucket.h"

namespace clothstream::schedule {

// A change of a solver may need new tables, buffers and kernels, which take milliseconds to seconds to make.
// Such a change is paid for by the time that it took, so that its cost need not be known before. Changes that
// make nothing are not limited. Takes its time as an argument. Not thread-safe.
class MakingLimit {
 public:
  // Seconds of making in a second, and at once.
  static constexpr double kShare = 0.05, kBurst = 0.1;

  // A tick begins.
  void beginTick() { made_ = false; }
  // Returns whether changes that make something may be applied now. Otherwise they wait until earlier ones
  // are paid for.
  bool allows(Clock::time_point now) { return seconds_.take(now, 0); }
  // Changes took these seconds.
  void pay(Clock::time_point now, double seconds) {
    made_ = true;
    seconds_.pay(now, seconds);
  }
  // Returns whether something was paid for in this tick.
  bool made() const { return made_; }

 private:
  TokenBucket seconds_{kShare, kBurst};
  bool made_ = false;
};

}  // namespace clothstream::schedule
