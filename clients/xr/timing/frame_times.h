// SPDX-License-Identifier: MIT
// Cost and rate of displayed frames, for the log and the panel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace clothstream::xr {

class FrameTimes {
 public:
  struct Summary {
    std::size_t frames = 0;  // of the newest second
    double framesPerSecond = 0;
    double cpuMedianMs = 0, cpuMostMs = 0;  // time of the processor per frame, without waiting
  };

  // A frame whose work took cpuUs on the thread that draws, and which ended at nowUs.
  void add(std::uint64_t nowUs, std::uint64_t cpuUs);
  // Number of all frames so far.
  std::uint64_t total() const { return total_; }
  // Sums up the frames that ended in the second before nowUs.
  Summary summary(std::uint64_t nowUs) const;

 private:
  struct Frame {
    std::uint64_t endUs = 0, cpuUs = 0;
  };
  static constexpr std::size_t kFrames = 256;
  std::array<Frame, kFrames> frames_{};
  std::size_t next_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace clothstream::xr
