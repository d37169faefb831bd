// SPDX-License-Identifier: MIT
// Frames that were sent and are not acknowledged, and room for more.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// At most size() frames are on their way: 2, plus 1 for a peer that acknowledges several frames at once, plus
// the frames sent in one round-trip time. The round-trip time is the recent minimum of the time from sending
// a frame to its acknowledgement. A minimum is used because a queue on the way must not enlarge the window
// that feeds it.
//
// Takes its time as an argument. Not thread-safe.
class SendWindow {
 public:
  static constexpr std::size_t kMin = 2, kMax = 24;

  // Frames that may be sent and not acknowledged, of a stream of this rate in frames/s.
  std::size_t size(std::uint32_t rate) const;
  bool hasRoom(std::uint32_t rate) const { return inFlight() < size(rate); }
  // Frames that were sent and are not acknowledged.
  std::size_t inFlight() const { return sent_.size(); }

  struct Sent {
    std::uint64_t tick;
    std::size_t bytes;
    Clock::time_point time;
  };
  // Records a frame. Its tick is above that of all before it.
  void send(const Sent& frame);
  // The peer has decoded this tick. Returns the bytes of the frames that are acknowledged by it; nothing if
  // the tick was never sent.
  [[nodiscard]] std::optional<std::size_t> acknowledge(std::uint64_t tick, Clock::time_point now);
  // The peer continues with a key frame, and acknowledges none of the frames before it.
  void restart();

  // Frames that were sent may be lost: they are not awaited any more.
  void abandon();

  // Frame that waits longest for its acknowledgement; null if none does.
  const Sent* oldest() const { return sent_.empty() ? nullptr : &sent_.front(); }
  // Newest tick that was sent since the last restart().
  std::optional<std::uint64_t> newest() const { return newest_; }

 private:
  std::deque<Sent> sent_;  // not acknowledged
  std::optional<std::uint64_t> newest_;
  std::uint64_t newestEver_ = 0;
  bool leavesOut_ = false;           // the newest acknowledgement covered more than one frame
  std::optional<double> roundTrip_;  // s
};

}  // namespace clothstream::delivery
