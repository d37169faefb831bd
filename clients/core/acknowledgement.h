// SPDX-License-Identifier: MIT
// Which of the frames that came the server hears of.
#pragma once

#include <cstdint>
#include <optional>

namespace clothstream::client {

// All, but for one that follows an acknowledged one within kPauseUs: so every second of a fast stream. To a
// server of many, and to a headset's radio, an acknowledgement is half the work of a frame. Never are two
// left out in a row: a server that waits with two unacknowledged would wait for ever.
class Acknowledgement {
 public:
  static constexpr std::uint64_t kPauseUs = 20'000;

  // Of a frame that came now.
  bool due(std::uint64_t nowUs) {
    const bool isDue = !acknowledgedUs_ || nowUs - *acknowledgedUs_ >= kPauseUs;
    acknowledgedUs_ = isDue ? std::optional(nowUs) : std::nullopt;
    return isDue;
  }

 private:
  std::optional<std::uint64_t> acknowledgedUs_;  // the frame before
};

}  // namespace clothstream::client
