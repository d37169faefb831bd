// SPDX-License-Identifier: MIT
// Decides for how long a scene that harms others cannot be joined.
#pragma once

#include <optional>
#include <utility>

#include "server/schedule/back_off.h"
#include "server/schedule/clock.h"

namespace clothstream::hosting {

using schedule::Clock;

// A scene that a peer created is stopped for good. A scene that the server started with gets a second chance,
// because a participant may be the reason: the first time, the next join starts it with its own parameters.
// If it loses the device again, it is stopped for good. If it takes more than its price again, it can be
// joined again after kComebackPause, and after twice that each time, up to kLongestPause. Belongs to one
// thread. Takes its time as an argument.
class HarmPolicy {
 public:
  static constexpr std::chrono::seconds kComebackPause{10}, kLongestPause{600};

  // `created`: a peer created the scene.
  explicit HarmPolicy(bool created) : created_(created) {}

  // Both return the time for which the scene cannot be joined, which may be zero, or nothing if it is stopped
  // for good.
  std::optional<Clock::duration> losesDevice() {
    if (created_ || std::exchange(hasLostDevice_, true)) return std::nullopt;
    return Clock::duration::zero();
  }
  std::optional<Clock::duration> exceedsPrice(Clock::time_point now) {
    if (created_) return std::nullopt;
    return comeback_.fail(now);
  }

 private:
  const bool created_;
  bool hasLostDevice_ = false;
  schedule::BackOff comeback_{kComebackPause, kLongestPause};
};

}  // namespace clothstream::hosting
