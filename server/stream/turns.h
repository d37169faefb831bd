// SPDX-License-Identifier: MIT
// Which scenes take the device next.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/stream/clock.h"
#include "server/stream/pacer.h"

namespace clothstream::stream {

// When a scene's ticks are due, and what they take.
struct Turn {
  explicit Turn(std::uint32_t ticksPerSecond) : pacer(ticksPerSecond) {}

  // A tick has ended, and had the device for so long.
  void took(Clock::duration time, Clock::time_point now);

  Pacer pacer;
  bool running = false;
  Clock::duration cost{};     // of a tick, of late
  Clock::time_point ended{};  // the last one
  Clock::duration spare{};    // for Pacer::begin
};

// The longest that a scene may be behind because of others, beside its own period.
inline constexpr std::chrono::milliseconds kMostSpare{250};

// Nothing interrupts a tick. One that takes longer than another scene has between two of its own is long: it
// would make that one late. So a long tick waits until nothing else is due, but not beyond its even share of
// the device; there is one at a time; and the others catch up what it cost them. Puts those who begin now
// into `chosen`, in their order, and gives every one its `spare`.
void chooseTurns(std::span<Turn* const> turns, Clock::time_point now, std::vector<Turn*>& chosen);

}  // namespace clothstream::stream
