// SPDX-License-Identifier: MIT
// Decides when a client acknowledges a frame and when it requests a key frame.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

namespace clothstream::client {

// Acknowledges every frame of a slow stream and every second frame of a fast one: a frame is skipped if the
// frame before it was acknowledged less than kPauseUs ago. For a server with many clients, and for a
// headset's radio, an acknowledgement costs half as much as a frame. Two frames in a row are never skipped:
// the server stops sending when two frames are unacknowledged.
class Acknowledgement {
 public:
  static constexpr std::uint64_t kPauseUs = 20'000;

  // Whether to acknowledge the frame that arrived now. Call once for each frame.
  bool due(std::uint64_t nowUs) {
    const bool isDue = !acknowledgedUs_ || nowUs - *acknowledgedUs_ >= kPauseUs;
    acknowledgedUs_ = isDue ? std::optional(nowUs) : std::nullopt;
    return isDue;
  }

 private:
  std::optional<std::uint64_t> acknowledgedUs_;  // empty if the previous frame was skipped
};

// The ticks that the client acknowledges.
class Acknowledgements {
 public:
  // In lockstep, frames are then acknowledged by seen() only.
  void hold(bool on) { holds_ = on; }
  void begin() { pace_ = {}; }
  void connectionEnded() { unseen_.reset(); }

  // Whether to acknowledge the frame that was decoded now.
  bool decoded(std::uint64_t tick, bool lockstep, std::uint64_t nowUs) {
    if (lockstep && holds_) unseen_ = tick;
    return lockstep ? !holds_ : pace_.due(nowUs);
  }
  // The tick to acknowledge because the program has seen it, or nothing.
  std::optional<std::uint64_t> seen() { return std::exchange(unseen_, std::nullopt); }

 private:
  Acknowledgement pace_;
  bool holds_ = false;
  std::optional<std::uint64_t> unseen_;  // tick of a frame whose acknowledgement is held
};

// Limits key-frame requests to one per kShortestIntervalUs and one outstanding request. The server may refuse
// or drop a request, so it is repeated after kPatienceUs without a key frame.
class KeyFrameRequest {
 public:
  static constexpr std::uint64_t kShortestIntervalUs = 100'000;
  static constexpr std::uint64_t kPatienceUs = 1'000'000;

  // Call when a key frame is needed. Returns whether to send a request now, and then counts it as sent.
  bool wanted(std::uint64_t nowUs) {
    if (sentUs_ && nowUs - *sentUs_ < (outstanding_ ? kPatienceUs : kShortestIntervalUs)) return false;
    sentUs_ = nowUs;
    outstanding_ = true;
    return true;
  }
  // Call when a key frame arrived.
  void answered() { outstanding_ = false; }

 private:
  std::optional<std::uint64_t> sentUs_;
  bool outstanding_ = false;
};

}  // namespace clothstream::client
