// SPDX-License-Identifier: MIT
// Counts and rates of received frames.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace clothstream::client {

struct DecodedFrame {
  std::uint64_t tick = 0;
  bool key = false;
  bool hashMatches = true;
  std::uint32_t vertexCount = 0;
  std::size_t packetBytes = 0;
};

class FrameStatistics {
 public:
  // Counts a received packet, decodable or not. `tick` is from its header; empty if the header is malformed.
  // ticksPerFrame is the expected distance to the previous frame.
  void arrived(std::optional<std::uint64_t> tick, std::size_t packetBytes, std::uint32_t ticksPerFrame,
               std::uint64_t nowUs);
  void refused() { ++decodeErrors_; }
  void decoded(const DecodedFrame& frame, std::uint64_t nowUs);
  // Call after a new description, because ticks may restart.
  void forgetTicks() { newestArrivedTick_.reset(); }

  std::uint64_t tick() const { return tick_; }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t keyFrames() const { return keyFrames_; }
  std::uint64_t dropped() const { return dropped_; }
  std::uint64_t decodeErrors() const { return decodeErrors_; }
  std::uint64_t bytes() const { return bytes_; }
  std::uint64_t hashMismatches() const { return hashMismatches_; }

  // Rates over the last second, or since the first packet if that is shorter.
  double framesPerSecond(std::uint64_t nowUs) const;
  double kbitPerSecond(std::uint64_t nowUs) const;
  double bitsPerVertex() const;
  // Time between the first and the newest decoded frame.
  double streamSeconds() const;

 private:
  struct Arrival {
    std::uint64_t timeUs = 0;
    std::size_t bytes = 0;
    bool decoded = false;
  };
  // Frames of one second at the highest stream rate.
  static constexpr std::size_t kArrivals = 1024;

  template <typename Amount>
  double perSecond(std::uint64_t nowUs, Amount amount) const;

  std::uint64_t tick_ = 0, frames_ = 0, keyFrames_ = 0, dropped_ = 0, decodeErrors_ = 0, bytes_ = 0;
  std::uint64_t hashMismatches_ = 0;
  std::uint64_t decodedBytes_ = 0, decodedVertices_ = 0;
  std::uint64_t firstArrivalUs_ = 0, firstDecodedUs_ = 0, lastDecodedUs_ = 0;
  std::optional<std::uint64_t> newestArrivedTick_;
  std::array<Arrival, kArrivals> arrivals_{};
  std::size_t arrivalCount_ = 0;
};

}  // namespace clothstream::client
