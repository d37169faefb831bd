// SPDX-License-Identifier: MIT
// Reason for which a scene cannot be joined, for good or for a time.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/schedule/clock.h"

namespace clothstream::scene {

// Not thread-safe.
class Quarantine {
 public:
  // Refuses joins with this reason from now on; without `until`, for good. It replaces an earlier reason.
  void begin(std::string why, std::optional<schedule::Clock::time_point> until = {}) {
    why_ = std::move(why);
    until_ = until;
  }
  // Reason at this time, with the seconds that are left; empty if the scene can be joined.
  std::string reason(schedule::Clock::time_point now) const {
    if (!until_ || why_.empty()) return why_;
    const auto left = std::chrono::ceil<std::chrono::seconds>(*until_ - now).count();
    return left > 0 ? fmt::format("{}; join again in {} s", why_, left) : std::string();
  }

 private:
  std::string why_;
  std::optional<schedule::Clock::time_point> until_;
};

}  // namespace clothstream::scene
