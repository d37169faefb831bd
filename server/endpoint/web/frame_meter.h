// SPDX-License-Identifier: MIT
// Limits the WebSocket frames that a client sends.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {

// Reads the headers of all frames (RFC 6455 5.2) in the bytes of a connection: also of pings, pongs and empty
// fragments, which never become messages. Not thread-safe.
class FrameMeter {
 public:
  // Frames with less payload than kSmallBytes per second, and their burst. Those with more are limited by
  // their bytes (Limits::maxReadRate).
  static constexpr std::uint64_t kSmallBytes = 1024;
  static constexpr double kSmallFramesPerSecond = 2000, kSmallFramesAtOnce = 4000;

  // Counts the frames whose headers end in these bytes, which follow those of the last call. Returns false if
  // there were too many, now or before.
  bool add(std::span<const std::byte> bytes, schedule::Clock::time_point now);
  bool exceeded() const { return exceeded_; }

 private:
  // Number of bytes of the present header, as far as its first bytes tell.
  std::size_t headerBytes() const;
  std::uint64_t payloadBytes() const;

  static constexpr std::size_t kMaxHeaderBytes = 14;
  std::array<std::uint8_t, kMaxHeaderBytes> header_{};
  std::size_t headerRead_ = 0;     // bytes of the present header that were read
  std::uint64_t payloadLeft_ = 0;  // bytes of the present frame's payload that follow
  schedule::TokenBucket frames_{kSmallFramesPerSecond, kSmallFramesAtOnce};
  bool exceeded_ = false;
};

}  // namespace clothstream::endpoint
