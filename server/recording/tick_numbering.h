// SPDX-License-Identifier: MIT
// Ticks of a played recording, as its clients get them.
#pragma once

#include <cstdint>

#include "server/recording/recorded_stream.h"

namespace clothstream::recording {

// Sent ticks always increase, whatever is played next. They differ from the recorded ones by a shift, modulo
// 2^64, which references between frames do not notice.
class TickNumbering {
 public:
  explicit TickNumbering(std::uint64_t ticksPerFrame) : ticksPerFrame_(ticksPerFrame) {}

  // Newest tick sent; 0: none.
  std::uint64_t newest() const { return newest_; }
  std::uint64_t shifted(std::uint64_t recorded) const { return recorded + shift_; }

  // The next frame is this one, after a jump. The first frame of all keeps its tick, unless ticks could
  // overflow.
  void restart(std::uint64_t recorded) {
    if (newest_ == 0 && recorded <= kMaxFirstTick)
      shift_ = 0;
    else
      continueWith(recorded);
  }
  // The next frame is this one, in the order of the recording. A frame that refers to the previous one has a
  // larger tick; a key frame in a file from another program may not.
  void follow(std::uint64_t recorded) {
    if (shifted(recorded) <= newest_ || shifted(recorded) - newest_ > kMaxTickStep) continueWith(recorded);
  }
  void send(std::uint64_t shiftedTick) { newest_ = shiftedTick; }

 private:
  static constexpr std::uint64_t kMaxFirstTick = std::uint64_t{1} << 62;

  void continueWith(std::uint64_t recorded) { shift_ = newest_ + ticksPerFrame_ - recorded; }

  const std::uint64_t ticksPerFrame_;
  std::uint64_t shift_ = 0, newest_ = 0;
};

}  // namespace clothstream::recording
