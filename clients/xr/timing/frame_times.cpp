// SPDX-License-Identifier: MIT
#include "clients/xr/timing/frame_times.h"

#include <algorithm>

namespace clothstream::xr {

void FrameTimes::add(std::uint64_t nowUs, std::uint64_t cpuUs) {
  frames_[next_] = {nowUs, cpuUs};
  next_ = (next_ + 1) % kFrames;
  ++total_;
}

FrameTimes::Summary FrameTimes::summary(std::uint64_t nowUs) const {
  constexpr std::uint64_t kSecond = 1'000'000;
  std::array<std::uint64_t, kFrames> costs{};
  Summary summary;
  std::uint64_t first = nowUs, last = 0;
  for (const Frame& frame : frames_) {
    if (frame.endUs == 0 || frame.endUs + kSecond < nowUs) continue;
    costs[summary.frames++] = frame.cpuUs;
    first = std::min(first, frame.endUs);
    last = std::max(last, frame.endUs);
  }
  if (summary.frames == 0) return summary;
  const auto end = costs.begin() + static_cast<std::ptrdiff_t>(summary.frames);
  const auto middle = costs.begin() + static_cast<std::ptrdiff_t>(summary.frames / 2);
  std::nth_element(costs.begin(), middle, end);
  summary.cpuMedianMs = static_cast<double>(*middle) / 1000;
  summary.cpuMostMs = static_cast<double>(*std::max_element(costs.begin(), end)) / 1000;
  if (last > first)
    summary.framesPerSecond =
        static_cast<double>(summary.frames - 1) * 1e6 / static_cast<double>(last - first);
  return summary;
}

}  // namespace clothstream::xr
