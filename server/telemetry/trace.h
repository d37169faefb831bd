// SPDX-License-Identifier: MIT
// Where the time of a scene's newest ticks went.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string_view>
#include <vector>

namespace clothstream::telemetry {

// What works during a span.
enum class TraceTrack : std::uint8_t { tick, device, packets };
inline constexpr std::array<std::string_view, 3> kTraceTracks{"tick", "device", "packets"};

struct TraceSpan {
  std::string_view name;  // static storage
  TraceTrack track = TraceTrack::tick;
  std::chrono::steady_clock::time_point start;
  std::chrono::steady_clock::duration length{};
  std::uint64_t tick = 0;
};

// Keeps the newest spans. Thread-safe; allocates only when constructed.
class Trace {
 public:
  static constexpr std::size_t kSpans = 4096;  // some seconds at 72 ticks a second

  void add(const TraceSpan& span);
  // Spans that end at `begin` or later, in the order of add().
  std::vector<TraceSpan> since(std::chrono::steady_clock::time_point begin) const;

 private:
  mutable std::mutex mutex_;
  std::vector<TraceSpan> spans_ = std::vector<TraceSpan>(kSpans);
  std::size_t count_ = 0;  // of all spans ever added
};

}  // namespace clothstream::telemetry
