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
  // `isGuest`: all guests together get the share of one scene.
  explicit TickSchedule(std::uint32_t ticksPerSecond, bool isGuest = false)
      : pacer(ticksPerSecond), guest(isGuest) {}

  // Records a tick that ended at `now` and used the device for `time`.
  void tickEnded(Clock::duration time, Clock::time_point now);

  Pacer pacer;
  bool guest;  // may change between two calls of the scheduler
  bool running = false;
  bool begun = false;         // the current tick has begun, and is not finished
  Clock::duration cost{};     // recent average for one tick
  Clock::time_point ended{};  // end of the newest tick
  Clock::duration catchUp{};  // for Pacer::begin(), set by TickScheduler::choose()
};

// Share of the device for one tick of a running scene: its part of the tick's period if every running scene
// needed the device all the time. Guests take nothing of the others' shares. `schedules` has all scenes.
Clock::duration shareOf(const TickSchedule& schedule, std::span<const TickSchedule* const> schedules);

// Longest lateness, in addition to one period, that other scenes may cause and that a scene catches up.
inline constexpr std::chrono::milliseconds kMaxCatchUp{250};

// A tick is long if it takes more than another scene's period, because it makes that scene late. One long
// tick begins at a time. It waits until nothing else is due, but not longer than its equal share of the
// device allows. The other scenes catch up what it cost them.
//
// While other scenes run, guests begin one tick at a time. They run within their share of the device, and
// beyond it in gaps between the ticks of the others. So they do not take frames from the scenes of the
// server, whatever they cost.
// Not thread-safe.
class TickScheduler {
 public:
  // `slice`: time for which a tick of a guest occupies the device without interruption, at most if its work
  // is as expected.
  explicit TickScheduler(Clock::duration slice) : slice_(slice) {}

  // Puts the schedules whose tick begins now into `chosen`, in the order in which they begin. Sets `catchUp`
  // of all schedules.
  void choose(std::span<TickSchedule* const> schedules, Clock::time_point now,
              std::vector<TickSchedule*>& chosen);
  // Earliest time at which a guest may use the device, as far as is known at `now`.
  Clock::time_point guestsFrom(std::span<TickSchedule* const> schedules, Clock::time_point now);
  // Records that this scene used the device for `time`.
  void used(const TickSchedule& schedule, Clock::duration time);

 private:
  void grant(Clock::time_point now, std::int64_t others);

  const Clock::duration slice_;
  Clock::duration excess_{};   // device time that guests used beyond their share
  Clock::duration longest_{};  // of the newest uses of a guest; falls slowly
  Clock::time_point granted_{};
};

}  // namespace clothstream::schedule
