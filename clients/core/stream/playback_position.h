// SPDX-License-Identifier: MIT
// Where the server is in the recording that it plays.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "clients/core/core.h"

namespace clothstream::client {

// The server tells the position when it starts, pauses, or changes its speed or place.
class PlaybackPosition {
 public:
  void told(const cs_playback& playback, std::uint64_t nowUs) {
    told_ = playback;
    toldUs_ = nowUs;
  }
  // Nothing if the server plays no recording.
  std::optional<cs_playback> at(std::uint64_t nowUs) const {
    if (!told_ || told_->paused != 0 || nowUs < toldUs_) return told_;
    cs_playback now = *told_;
    now.position =
        std::min(now.length, now.position + static_cast<double>(nowUs - toldUs_) * 1e-6 * now.speed);
    return now;
  }

 private:
  std::optional<cs_playback> told_;
  std::uint64_t toldUs_ = 0;
};

}  // namespace clothstream::client
