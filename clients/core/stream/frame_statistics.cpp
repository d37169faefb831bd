// SPDX-License-Identifier: MIT
// Computes rates from a ring buffer of the last arrivals.
#include "clients/core/stream/frame_statistics.h"

#include <algorithm>

namespace clothstream::client {
namespace {

constexpr std::uint64_t kWindowUs = 1'000'000;
// Shortest window for rates: a shorter one at the start of a stream is not meaningful.
constexpr std::uint64_t kShortestWindowUs = 100'000;

}  // namespace

void FrameStatistics::arrived(std::optional<std::uint64_t> tick, std::size_t packetBytes,
                              std::uint32_t ticksPerFrame, std::uint64_t nowUs) {
  if (arrivalCount_ == 0) firstArrivalUs_ = nowUs;
  arrivals_[arrivalCount_ % kArrivals] = {nowUs, packetBytes, false};
  ++arrivalCount_;
  bytes_ += packetBytes;
  if (!tick || (newestArrivedTick_ && *tick <= *newestArrivedTick_)) return;
  if (newestArrivedTick_)
    dropped_ += std::max<std::uint64_t>((*tick - *newestArrivedTick_) / ticksPerFrame, 1) - 1;
  newestArrivedTick_ = tick;
}

void FrameStatistics::decoded(const DecodedFrame& frame, std::uint64_t nowUs) {
  arrivals_[(arrivalCount_ - 1) % kArrivals].decoded = true;
  if (frames_ == 0) firstDecodedUs_ = nowUs;
  lastDecodedUs_ = nowUs;
  tick_ = frame.tick;
  ++frames_;
  if (frame.key) ++keyFrames_;
  if (!frame.hashMatches) ++hashMismatches_;
  decodedBytes_ += frame.packetBytes;
  decodedVertices_ += frame.vertexCount;
}

template <typename Amount>
double FrameStatistics::perSecond(std::uint64_t nowUs, Amount amount) const {
  if (arrivalCount_ == 0) return 0;
  const std::uint64_t window = std::clamp(nowUs - firstArrivalUs_, kShortestWindowUs, kWindowUs);
  double sum = 0;
  for (std::size_t back = 1; back <= std::min(arrivalCount_, kArrivals); ++back) {
    const Arrival& arrival = arrivals_[(arrivalCount_ - back) % kArrivals];
    if (nowUs - arrival.timeUs >= window) break;
    sum += amount(arrival);
  }
  return sum / (static_cast<double>(window) * 1e-6);
}

double FrameStatistics::framesPerSecond(std::uint64_t nowUs) const {
  return perSecond(nowUs, [](const Arrival& arrival) { return arrival.decoded ? 1.0 : 0.0; });
}

double FrameStatistics::kbitPerSecond(std::uint64_t nowUs) const {
  return perSecond(nowUs,
                   [](const Arrival& arrival) { return static_cast<double>(arrival.bytes) * 8 / 1000; });
}

double FrameStatistics::bitsPerVertex() const {
  return decodedVertices_ == 0
             ? 0
             : static_cast<double>(decodedBytes_) * 8 / static_cast<double>(decodedVertices_);
}

double FrameStatistics::streamSeconds() const {
  return static_cast<double>(lastDecodedUs_ - firstDecodedUs_) * 1e-6;
}

}  // namespace clothstream::client
