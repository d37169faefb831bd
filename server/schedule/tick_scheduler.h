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

  // Set by TickScheduler::used(), for guests.
  Clock::duration longestUse{};   // of the newest uses of the device; falls slowly
  Clock::time_point newestUse{};  // end of the newest one, as if those of a batch followed each other
};

// Longest lateness, in addition to one period, that other scenes may cause and that a scene catches up.
inline constexpr std::chrono::milliseconds kMaxCatchUp{250};

// A tick is long if it takes more than another scene's period, because it makes that scene late. One long
// tick begins at a time. It waits until nothing else is due, but not longer than its equal share of the
// device allows. The other scenes catch up what it cost them.
//
// While other scenes run, guests use the device within their common share, and beyond it in the gaps between
// the ticks of the others. So they do not take frames from the scenes of the server, whatever they cost. All
// guests that are due and fit, by their recent cost, begin together. The one that has waited longest, for a
// tick or for the next slice of its tick, comes first. Those that do not fit are passed over, each for as
// long as its equal part of the common share allows.
//
// Allocates nothing once it has seen the largest number of scenes. Not thread-safe.
class TickScheduler {
 public:
  // `slice`: time for which a tick of a guest occupies the device without interruption, at most if its work
  // is as expected. A guest whose cost is not known is expected to take as long.
  explicit TickScheduler(Clock::duration slice) : slice_(slice) {}

  // Notes the state of all scenes at `now`, which the functions below refer to. Linear in their number.
  void observe(std::span<const TickSchedule* const> schedules, Clock::time_point now);
  // Observes the scenes, and puts the schedules whose tick begins now into `chosen`, in the order in which
  // they begin. Sets `catchUp` of all schedules. Takes n log n time.
  void choose(std::span<TickSchedule* const> schedules, Clock::time_point now,
              std::vector<TickSchedule*>& chosen);
  // Earliest time at which the scene may use the device, as far as is known: the time of the observation,
  // except for guests that must wait.
  Clock::time_point earliest(const TickSchedule& schedule) const;
  // Share of the device for one tick of a running scene: its part of the tick's period if every running scene
  // needed the device all the time. Guests take nothing of the others' shares.
  Clock::duration shareOf(const TickSchedule& schedule) const;
  // Records that this scene used the device for `time`, before tickEnded(). Call it for each member of a
  // batch, with its part of the batch's time.
  void used(TickSchedule& schedule, Clock::duration time);

 private:
  // Puts the due short ticks of scenes of equal rights into `due`, by due time, and sets `catchUp` of all.
  // Returns the long tick that is due first; null if there is none.
  static TickSchedule* collectDue(std::span<TickSchedule* const> schedules, Clock::time_point now,
                                  std::vector<TickSchedule*>& due);
  static void chooseAmongEquals(std::span<TickSchedule* const> schedules, Clock::time_point now,
                                std::vector<TickSchedule*>& chosen);
  void chooseGuests(Clock::time_point now, std::vector<TickSchedule*>& chosen);
  // Expected time of the next use of the device by this guest.
  Clock::duration expectedUse(const TickSchedule& guest) const;
  // Time from which the waiting guest may use the device, although it does not fit: its equal part of the
  // guests' share has grown to that use.
  Clock::time_point entitledFrom(const TickSchedule& guest) const;

  const Clock::duration slice_;

  // The newest observation.
  Clock::time_point now_{};
  std::int64_t own_ = 0, guests_ = 0;  // numbers of running scenes
  Clock::duration gap_{};              // time until a scene of the server is due

  // Device time that guests used beyond their share: from minus one slice, which they may save, to
  // kMaxCatchUp.
  Clock::duration excess_{};
  Clock::time_point lastUse_{};  // TickSchedule::newestUse of the guest that was recorded last

  std::vector<TickSchedule*> ownSchedules_, guestSchedules_, waiting_;  // reused by choose()
};

}  // namespace clothstream::schedule
