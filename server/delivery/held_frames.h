// SPDX-License-Identifier: MIT
// Frames that wait for room, in the order in which a decoder can use them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "server/delivery/published_frame.h"

namespace clothstream::delivery {

// A predicted frame is held only if it refers to the newest frame before it. At most kMax frames of at most
// kMaxBytes in all, or one larger frame, are held. If more arrive, all are dropped. After every gap only a
// key frame continues, and it replaces what is held.
//
// Not thread-safe.
class HeldFrames {
 public:
  static constexpr std::size_t kMax = 3;
  static constexpr std::size_t kMaxBytes = 1024 * 1024;

  struct Added {
    bool held = false;
    bool overflowed = false;  // everything was dropped because there was no room
    std::size_t dropped = 0;  // frames, this one included
  };
  // Holds the frame if it can be decoded after the others and there is room. A key frame is always held.
  Added add(const PublishedFrame& frame);

  bool empty() const { return frames_.empty(); }
  const PublishedFrame& front() const { return frames_.front(); }
  PublishedFrame take();

  // Only a key frame continues. True at first.
  bool needsKey() const { return needsKey_; }
  // Drops all frames, and returns their number.
  std::size_t clear();
  // Same, because the decoder cannot continue: it needs a key frame.
  std::size_t restart();

 private:
  std::vector<PublishedFrame> frames_;  // few, so that the first may be erased
  std::size_t bytes_ = 0;
  bool needsKey_ = true;
  // Tick of the newest frame that is held, or else was taken, or was dropped while a key frame is awaited.
  std::uint64_t newest_ = 0;
};

}  // namespace clothstream::delivery
