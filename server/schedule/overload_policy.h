// SPDX-License-Identifier: MIT
// Decides how much a scene reduces its work while the device cannot keep up with it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/schedule/clock.h"

namespace clothstream::schedule {

// Work of a scene: every frameDivisor-th frame of its stream rate, and substeps of a tick. Both at least 1.
struct WorkLevel {
  std::uint32_t frameDivisor = 1, substeps = 1;

  friend bool operator==(const WorkLevel&, const WorkLevel&) = default;
};

// A scene is overloaded if simulated time falls behind real time and its own ticks need more than its share
// of the device. It then steps down once an interval: first to a half and a quarter of its frames, then to
// three quarters, a half and a quarter of its substeps. Beyond that, simulated time is slower. A scene whose
// ticks fit their share is late because of other work and does not step down.
//
// Disturbed ticks are left out, and their time does not count: an interval has kInterval of undisturbed time.
// After kLongestDisturbance without a complete interval they count, so that a scene is judged even while
// other scenes are loaded all the time.
//
// The scene steps up again after a pause without slip, if the higher level is expected to fit. A step up that
// fails within twice the pause doubles the pause, so that levels do not oscillate.
//
// Belongs to one thread. Takes its time as an argument.
class OverloadPolicy {
 public:
  // Time over which a scene is judged.
  static constexpr std::chrono::seconds kInterval{1};
  // Time without slip before a step up: at first, and at most.
  static constexpr std::chrono::seconds kPause{10}, kLongestPause{160};
  // Longest time for which disturbed ticks are left out, until the next interval is complete.
  static constexpr std::chrono::seconds kLongestDisturbance{10};
  // Simulated seconds per real second below which time slips, as for SlowWatch.
  static constexpr double kSlow = 0.95;
  // Part of its share that the ticks of a scene may need, and part that they may need after a step up.
  static constexpr double kMostUse = 0.9, kMostUseAfterStepUp = 0.8;
  // Largest factor by which doubling the frames is expected to lengthen a tick.
  static constexpr double kFrameGrowth = 1.25;
  // Streams do not fall below this rate, in frames/s.
  static constexpr std::uint32_t kLowestStreamRate = 10;

  // Stream rate in frames/s and substeps of the scene, both at least 1.
  OverloadPolicy(std::uint32_t streamRate, std::uint32_t substeps);

  // A tick that has ended.
  struct Tick {
    Clock::time_point now;    // its end
    double slippedTicks = 0;  // ticks by which simulated time fell behind before it
    Clock::duration own{};    // time that it needed, without waiting for other work
    Clock::duration share{};  // share of the device for one tick
    Clock::duration idle{};   // time without work for the device since any fixed time
    bool disturbed = false;   // work that is not of a tick used the device, such as loading another scene
  };
  // Records a tick of the level of `level(leastSubsteps)`. `leastSubsteps`: with fewer ones the scene would
  // be unstable. Returns true if the level has changed.
  bool note(const Tick& tick, std::uint32_t leastSubsteps);

  // The scene has paused: starts a new interval.
  void restart() { began_.reset(); }

  // Begins at the level of this work, which another policy for the same scene chose.
  void beginAt(const WorkLevel& work);

  // Present level, with at least this number of substeps.
  WorkLevel level(std::uint32_t leastSubsteps = 1) const;

 private:
  WorkLevel at(std::size_t index, std::uint32_t leastSubsteps) const;
  void begin(const Tick& tick);
  // Moves the interval by the time of this tick, which is left out.
  void leaveOut(const Tick& tick);
  bool stepDown(Clock::time_point now, std::uint32_t leastSubsteps);
  bool stepUp(const Tick& tick, std::uint32_t leastSubsteps);

  std::vector<WorkLevel> levels_;  // from all work to the least
  std::size_t index_ = 0;

  std::optional<Clock::time_point> began_;  // interval
  Clock::duration idleBefore_{}, own_{};
  double ticks_ = 0, slipped_ = 0;
  bool disturbed_ = false;                 // the newest tick was left out
  Clock::time_point newest_{}, judged_{};  // ends of the newest tick, and of the newest complete interval
  Clock::duration newestIdle_{};           // at newest_

  Clock::time_point calmSince_{};
  std::optional<Clock::time_point> steppedUp_;  // newest step up since the newest step down
  Clock::duration pause_ = kPause;
};

}  // namespace clothstream::schedule
