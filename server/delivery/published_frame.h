// SPDX-License-Identifier: MIT
// A frame on its way to the subscribers of a scene.
#pragma once

#include <cstdint>
#include <utility>

#include "proto/codec/packet_header.h"
#include "server/delivery/envelope.h"
#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// One packet in its message. Immutable once published.
struct PublishedFrame {
  SharedBytes message;
  std::uint64_t tick = 0;
  bool key = false;
  std::uint64_t referenceTick = 0;  // of a predicted frame
  std::uint8_t quality = 0;
  Clock::time_point complete{};
  // A frame of this tick was published before. Only subscribers that need a key frame take it.
  bool repeated = false;
};

// Frame in `message` whose packet has this header.
inline PublishedFrame publishedFrame(const codec::PacketHeader& header, SharedBytes message,
                                     Clock::time_point complete) {
  return {.message = std::move(message),
          .tick = header.tick,
          .key = header.kind == codec::PacketKind::key,
          .referenceTick = header.references[0],
          .quality = header.quality,
          .complete = complete};
}

// Rate and qualities of a scene's stream.
struct StreamShape {
  std::uint32_t rate = 0;  // frames/s
  // Number of qualities of each frame. 1 means a single quality, which may have any number.
  std::uint8_t qualities = 1;
  // The next frame is published when every subscriber has acknowledged the last one. The quality then does
  // not adapt to the link.
  bool lockstep = false;
};

// Qualities of the next frame that subscribers ask for. Bit n stands for quality n.
struct RequestedFrames {
  std::uint8_t qualities = 0;  // at least one subscriber receives this quality or waits for it
  std::uint8_t keyFrames = 0;  // subset of `qualities`: a subscriber waits for a key frame

  RequestedFrames& operator|=(const RequestedFrames& other) {
    qualities |= other.qualities;
    keyFrames |= other.keyFrames;
    return *this;
  }
};

}  // namespace clothstream::delivery
