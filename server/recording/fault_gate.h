// SPDX-License-Identifier: MIT
// Faults of a played recording, in the order of its frames.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "server/recording/fault_plan.h"
#include "server/schedule/clock.h"

namespace clothstream::recording {

// Decides about one frame after the other. A frame that is held keeps the next ones from being asked about.
class FaultGate {
 public:
  using Clock = schedule::Clock;
  enum class Passage : std::uint8_t { free, dropped, held };

  // Without a seed every frame passes.
  explicit FaultGate(std::optional<std::uint32_t> seed)
      : plan_(seed ? std::optional<FaultPlan>(*seed) : std::nullopt) {}

  // Effect of the faults on a frame now. A frame that is held passes freely from heldUntil() on. `scene` and
  // `time`, s, are for the log.
  Passage passageOf(std::uint64_t recordedTick, Clock::time_point now, const std::string& scene, double time);
  // The time at which a frame that has passed was held, else `now`.
  Clock::time_point takeStart(Clock::time_point now);
  // Unset if no frame is held.
  const std::optional<Clock::time_point>& heldUntil() const { return heldUntil_; }
  // The frame that is held is not played any more.
  void reset() { heldSince_ = heldUntil_ = std::nullopt; }

 private:
  const std::optional<FaultPlan> plan_;
  std::optional<Clock::time_point> heldSince_, heldUntil_;
};

}  // namespace clothstream::recording
