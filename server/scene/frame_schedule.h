// SPDX-License-Identifier: MIT
// Chooses which ticks of a scene have a frame, which frames carry a report, and which are key frames.
#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "server/messages/limits.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

using schedule::Clock;

// Takes ticks and times as arguments. Ticks only grow. Not thread-safe.
class FrameSchedule {
 public:
  // Minimum interval between requested key frames of one quality. One key frame serves all subscribers.
  static constexpr std::chrono::milliseconds kKeyFrameInterval{100};
  // While the scene is recorded, at least one of this many frames is a key frame.
  static constexpr std::uint32_t kMaxKeyFrameDistance = 24;

  // Ticks/s, frames/s, which divide them, and frames/s that carry a report. With `reportRate` 0 none does.
  FrameSchedule(std::uint32_t simulationRate, std::uint32_t streamRate, double reportRate)
      : ticksPerFrame_(simulationRate / streamRate),
        ticksPerReport_(reportRate > 0 ? static_cast<std::uint64_t>(std::ceil(simulationRate / reportRate))
                                       : 0) {}

  // Returns whether `tick` has a frame while every divisor-th frame is sent. No frame is owed after it.
  bool takeFrame(std::uint64_t tick, std::uint32_t divisor) {
    if (tick % (std::uint64_t{ticksPerFrame_} * divisor) != 0) return false;
    owes_ = false;
    return true;
  }
  // Returns whether the frame of `tick` carries a report.
  bool takeReport(std::uint64_t tick) {
    if (ticksPerReport_ == 0 || tick < nextReport_) return false;
    nextReport_ = tick + ticksPerReport_;
    return true;
  }

  // The cloths were reset: subscribers are owed a frame that shows it.
  void owe() { owes_ = true; }
  bool owes() const { return owes_; }

  // Returns whether the next frame of this quality must be a key frame. `requested`: a subscriber waits for
  // one. `recorded`: the scene is recorded.
  bool needsKey(std::uint8_t quality, bool requested, bool recorded, Clock::time_point now) const {
    const bool due = recorded && quality == 0 && sinceKey_ + 1 >= kMaxKeyFrameDistance;
    return due || (requested && now - newestKey_[quality] >= kKeyFrameInterval);
  }
  // A frame was made. `keys`: the qualities, as bits, of which it is a key frame.
  void made(std::uint8_t keys, Clock::time_point now) {
    ++sinceKey_;
    if ((keys & 1) != 0) sinceKey_ = 0;
    madePaused(keys, now);
  }
  // Key frames were made while the scene is paused, which no recording contains.
  void madePaused(std::uint8_t keys, Clock::time_point now) {
    for (std::uint8_t quality = 0; quality < newestKey_.size(); ++quality)
      if ((keys >> quality & 1) != 0) newestKey_[quality] = now;
  }
  // The next frame of the finest quality is the first of a recording.
  void beginRecording() { sinceKey_ = kMaxKeyFrameDistance; }

 private:
  const std::uint32_t ticksPerFrame_;   // of all frames
  const std::uint64_t ticksPerReport_;  // minimum; 0: no reports
  std::uint64_t nextReport_ = 0;        // tick
  bool owes_ = false;
  std::array<Clock::time_point, messages::limits::kMaxQualities> newestKey_{};
  std::uint32_t sinceKey_ = 0;  // frames since a key frame of the finest quality
};

}  // namespace clothstream::scene
