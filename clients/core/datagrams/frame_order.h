// SPDX-License-Identifier: MIT
// Order of frames that arrive on two ways, the stream and datagrams, which can overtake one another.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/wire/wire.h"

namespace clothstream::client {

// Part of a packet's header that decides when it can be decoded.
struct FrameHeader {
  std::uint32_t epoch = 0;
  std::uint64_t tick = 0;
  std::optional<std::uint64_t> reference;  // tick of the frame that it needs; empty for a key frame
};
// nullopt if the serialised ServerMessage has no packet, or is malformed.
[[nodiscard]] std::optional<FrameHeader> frameHeader(Bytes message);

// Keeps a predicted frame until its reference has passed, and drops frames that are older than the newest
// one. A frame passes anyway after kHoldUs, or beyond the bounds on memory: the client then finds that its
// reference is missing, and requests a key frame. Reads no clock.
class FrameOrder {
 public:
  static constexpr std::uint64_t kHoldUs = 150'000;
  static constexpr std::size_t kMaxFrames = 32, kMaxBytes = std::size_t{4} << 20;

  // Takes a serialised ServerMessage. Returns true if it passes at once; messages other than frames do. Else
  // it is dropped, or next() returns it later. `isSure`: the reference, if it has not passed yet, may still
  // come. It may not if frames before this one are lost.
  [[nodiscard]] bool passes(Bytes message, bool isSure, std::uint64_t nowUs);

  // Takes the next frame that need not wait any more; empty if there is none. Call it after passes() until it
  // is empty, and at dueUs().
  std::string next(std::uint64_t nowUs);
  // Time at which next() may return a frame without a further one; nullopt if none waits.
  std::optional<std::uint64_t> dueUs() const;

  // Tick of the newest frame that has passed.
  std::optional<std::uint64_t> newestTick() const {
    return newest_ ? std::optional(newest_->tick) : std::nullopt;
  }
  // Frames that have waited.
  std::uint64_t heldFrames() const { return heldFrames_; }

 private:
  struct Held {
    FrameHeader header;
    std::string message;
    std::uint64_t untilUs;
  };

  bool isOld(const FrameHeader& header) const;
  // Whether waiting does not help: the client can decode the frame, or never will.
  bool isReady(const FrameHeader& header) const;

  std::optional<FrameHeader> newest_;  // that has passed
  std::vector<Held> held_;             // ticks ascend
  std::size_t heldBytes_ = 0;
  std::uint64_t heldFrames_ = 0;
};

}  // namespace clothstream::client
