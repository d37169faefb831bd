// SPDX-License-Identifier: MIT
// Divides the device time of a batch among its members.
#pragma once

#include <cassert>
#include <cstddef>
#include <span>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Gives each member the part of `time` that is in proportion to its work, in any unit and at least 0. The sum
// of the parts is exactly `time`, and a member without work gets nothing. All parts are 0 if no member has
// work. `time` must be at least 0 and at most 2^53 ns; `parts` has one place for each member.
inline void divideTime(Clock::duration time, std::span<const double> work, std::span<Clock::duration> parts) {
  assert(work.size() == parts.size());
  double total = 0;
  for (const double each : work) total += each;
  // Parts end at rounded fractions of the time. The last fraction is exactly 1.
  double sum = 0;
  Clock::duration end{};
  for (std::size_t i = 0; i < work.size(); ++i) {
    assert(work[i] >= 0);
    sum += work[i];
    const Clock::duration next =
        total > 0 ? Clock::duration(static_cast<Clock::rep>(sum / total * static_cast<double>(time.count())))
                  : Clock::duration::zero();
    parts[i] = next - end;
    end = next;
  }
}

}  // namespace clothstream::schedule
