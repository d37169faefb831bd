// SPDX-License-Identifier: MIT
// Congestion window of CUBIC, for sharing a bottleneck with flows that fill its buffer.
#pragma once

#include <cstdint>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// Congestion avoidance of RFC 9438, in bytes. A segment has the usual size of TCP's, so that the window grows
// as that of a TCP flow does. Not thread-safe.
class CubicWindow {
 public:
  static constexpr double kSegment = 1448;  // bytes
  static constexpr double kBeta = 0.7;      // section 4.6
  static constexpr double kC = 0.4;         // section 5.1

  // Starts at a window of `bytes`, as after a congestion event there.
  explicit CubicWindow(double bytes) : window_(bytes), plateau_(bytes), reno_(bytes), prior_(bytes) {}

  double window() const { return window_; }  // bytes

  // `bytes` were acknowledged while the window was in use. `passed` is the time since the call before, of
  // which only time in use counts; `roundTrip` is the smoothed round-trip time. Both in s.
  void acknowledge(double bytes, double passed, double roundTrip);
  // A congestion event. Call it once for each round trip at most.
  void reduce();

 private:
  double window_, plateau_;  // bytes; plateau_: W_max
  double reno_, prior_;      // bytes; W_est and cwnd_prior
  double time_ = 0;          // s since the newest congestion event
  double climb_ = 0;         // s; K
};

}  // namespace clothstream::delivery
