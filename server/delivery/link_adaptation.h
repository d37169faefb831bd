// SPDX-License-Identifier: MIT
// Adapts the quality that one subscriber receives to the throughput of its link.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// Steps between the quality that a subscriber asked for and the coarsest one. update() is called with every
// frame and says whether the subscriber is behind. Time spent behind adds up as strain; time spent not behind
// reduces it half as fast, so that a single delay counts for little.
//
// Step down: when the strain reaches kPatience, to the finest quality that the recent throughput can carry.
// Step up: one quality at a time, after a period in which the subscriber was hardly behind. If a step up
// fails within kTrial, the wait before the next one doubles. The wait is bounded so that the way from the
// coarsest quality to the finest takes 3 s at most. With a single quality nothing changes.
//
// Where a rate controller measures the link (RateController), its rate replaces the measured throughput. Time
// in which frames exceed that rate counts as strain, and quality steps up only if the link carries the finer
// one. To find that out, the sender fills frames up to kProbe times their size, as far as the link has room.
//
// Not thread-safe. Reads no clock: all times are arguments.
class LinkAdaptation {
 public:
  static constexpr std::chrono::milliseconds kPatience{200}, kTrial{1000};
  // Bounds of the wait before the first step up after a step down; kClimb is the wait after a successful
  // step.
  static constexpr std::chrono::milliseconds kShortestWait{500}, kLongestWait{1500}, kClimb{250};
  // Strain that dropping frames adds, however many are dropped at once.
  static constexpr std::chrono::milliseconds kDropStrain{100};
  // Bit rate of a quality relative to the next finer one. Measured: less for calm cloth, more for a flag.
  static constexpr double kCoarserRate = 0.7;

  // Share of the link's throughput that frames may use; the rest is for control messages.
  static constexpr double kUsedThroughput = 0.9;
  static constexpr double kProbe = 1 / (kCoarserRate * kUsedThroughput);

  // The subscriber asked for the quality `finest`; the last one of the stream is `coarsest`.
  LinkAdaptation(std::uint8_t finest, std::uint8_t coarsest)
      : finest_(finest), coarsest_(coarsest), quality_(finest) {}

  std::uint8_t quality() const { return quality_; }
  // The link has lowered the quality.
  bool wantsFiner() const { return quality_ > finest_; }

  // Records a frame of the subscriber's quality.
  void made(std::uint8_t quality, std::size_t bytes, Clock::time_point now);
  // Records bytes that the subscriber acknowledged.
  void delivered(std::size_t bytes) { delivered_ += bytes; }
  // Records that frames were dropped because they waited too long.
  void dropped(Clock::time_point now) { strain(kDropStrain, now); }
  // Call at least with each frame. `behind`: something waits for the subscriber. `linkRate`: bytes/s that
  // frames may take, if a rate controller measures the link. Returns whether the quality has changed.
  bool update(bool behind, Clock::time_point now, std::optional<double> linkRate = std::nullopt);

 private:
  // Adds strain. `since` is its beginning if there was none before.
  void strain(Clock::duration more, Clock::time_point since);
  void stepDown(Clock::time_point now, std::optional<double> linkRate);
  void stepUp(Clock::time_point now);
  double bytesPerSecond(std::uint8_t quality) const;

  std::uint8_t finest_, coarsest_, quality_;

  double rate_ = 0;  // bytes/s in rateQuality_
  std::uint8_t rateQuality_ = 0;
  std::optional<Clock::time_point> newestMade_;

  std::optional<Clock::time_point> newestUpdate_;
  Clock::duration strain_{}, calm_{};
  Clock::time_point strainedSince_{};
  std::size_t delivered_ = 0;  // bytes since strainedSince_
  Clock::duration wait_ = kShortestWait, backOff_ = kShortestWait;
  std::optional<Clock::time_point> steppedUp_;  // newest step up
};

}  // namespace clothstream::delivery
