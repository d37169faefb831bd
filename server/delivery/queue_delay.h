// SPDX-License-Identifier: MIT
// Queue delay of a path, from times on two clocks that are not synchronised.
#pragma once

#include <cstdint>
#include <optional>

#include "server/delivery/recent_minimum.h"
#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// The queue delay is the one-way delay minus the base delay, which is the lowest one-way delay in the history
// of RecentMinimum (RFC 6817, section 3.4.2). The offset of the two clocks cancels out.
//
// A lower base counts at once. A higher one, after a change of the route or because of clock drift, counts
// when the history has passed. Clocks that drift by 100 ppm falsify the delay by at most 3 ms.
//
// Not thread-safe.
class QueueDelay {
 public:
  // A packet that was sent at `sent` arrived at `arrivalUs`: microseconds on the receiver's clock, which
  // wrap. The delays of consecutive samples must not differ by more than 35 minutes.
  void add(Clock::time_point sent, std::uint32_t arrivalUs, Clock::time_point now);

  // Newest sample, s.
  double newest() const { return newest_; }
  // Filtered delay, s. It follows falling samples at once, and rising ones with the time constant kRise, so
  // that delays of single packets count for little (SCReAMv2, "Detecting Increased Queue Delay").
  double filtered() const { return filtered_; }
  // Mean deviation of the delay between consecutive samples, s (RFC 3550, section 6.4.1).
  double jitter() const { return jitter_; }

  static constexpr double kRise = 0.04;  // s

 private:
  RecentMinimum base_;                  // us
  std::optional<std::int64_t> oneWay_;  // us; newest one-way delay plus the unknown offset of the clocks
  Clock::time_point newestTime_{};
  double newest_ = 0, filtered_ = 0;
  double jitter_ = 0.005;  // a usual value at first
};

}  // namespace clothstream::delivery
