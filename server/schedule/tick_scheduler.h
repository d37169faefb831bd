// SPDX-License-Identifier: MIT
// Chooses the scenes whose tick runs next on the shared device.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/schedule/clock.h"
#include "server/schedule/pacer.h"

namespace clothstream::schedule {

// Due times and cost of one scene's ticks.
struct TickSchedule {
  explicit TickSchedule(std::uint32_t ticksPerSecond) : pacer(ticksPerSecond) {}

  // Records a tick that ended at `now` and used the device for `time`.
  void tickEnded(Clock::duration time, Clock::time_point now);

  Pacer pacer;
  bool running = false;
  Clock::duration cost{};     // recent average for one tick
  Clock::time_point ended{};  // end of the newest tick
  Clock::duration catchUp{};  // for Pacer::begin(), set by scheduleTicks()
};

// Longest lateness, in addition to one period, that other scenes may cause and that a scene catches up.
inline constexpr std::chrono::milliseconds kMaxCatchUp{250};

// Puts the schedules whose tick starts now into `chosen`, in the order in which they start. Sets `catchUp` of
// all schedules. A tick cannot be interrupted. A tick is long if it takes more than another scene's period,
// because it makes that scene late. One long tick runs at a time. It waits until nothing else is due, but not
// longer than its equal share of the device allows. The other scenes catch up what it cost them.
void scheduleTicks(std::span<TickSchedule* const> schedules, Clock::time_point now,
                   std::vector<TickSchedule*>& chosen);

}  // namespace clothstream::schedule
