// SPDX-License-Identifier: MIT
#include "server/delivery/held_frames.h"

#include <utility>

namespace clothstream::delivery {

HeldFrames::Added HeldFrames::add(const PublishedFrame& frame) {
  const std::size_t bytes = frame.message->size();
  Added added{.held = true};
  if (frame.key) {
    added.dropped = clear();
    needsKey_ = false;
  } else if (needsKey_ || frame.referenceTick != newest_) {
    needsKey_ = true;
    return {.dropped = 1};
  } else if (!frames_.empty() && (frames_.size() == kMax || bytes_ + bytes > kMaxBytes)) {
    return {.overflowed = true, .dropped = restart() + 1};
  }
  frames_.push_back(frame);
  bytes_ += bytes;
  newest_ = frame.tick;
  return added;
}

PublishedFrame HeldFrames::take() {
  PublishedFrame frame = std::move(frames_.front());
  frames_.erase(frames_.begin());
  bytes_ -= frame.message->size();
  return frame;
}

std::size_t HeldFrames::clear() {
  const std::size_t dropped = frames_.size();
  frames_.clear();
  bytes_ = 0;
  return dropped;
}

std::size_t HeldFrames::restart() {
  needsKey_ = true;
  return clear();
}

}  // namespace clothstream::delivery
