// SPDX-License-Identifier: MIT
// Distance of simulated states from the frames of a recording, which show a state much more often than
// checkpoints do.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "proto/recording/frame_check.h"
#include "server/model/scene.h"
#include "server/simulation/state_snapshot.h"

namespace clothstream::recording {

// Distance of nodes from their recorded positions, metres.
struct Difference {
  std::uint64_t tick = 0;
  double largest = 0, mean = 0;
};

// Frames follow the tick that they show, because they are encoded after it.
class FrameDistance {
 public:
  // States that wait for their frame. Older ones are dropped.
  static constexpr std::size_t kMaxWaiting = 16;

  // The layout is that of the recorded stream.
  explicit FrameDistance(const codec::StreamLayout& layout);

  // Keeps the state of a tick until its frame comes. Ticks must ascend.
  void add(std::uint64_t tick, std::vector<model::Vec3> positions);
  // Decodes a serialised Frame. `seconds` is its time since the start of the recording.
  void take(std::string_view frame, double seconds);
  // Frames that cannot be decoded, or differ from their recorded hash.
  const FrameFaults& faults() const { return check_ ? check_->faults() : unknown_; }

  // Number of frames that were compared, and the one with the largest distance.
  std::uint64_t frames() const { return frames_; }
  const Difference& largest() const { return largest_; }

 private:
  struct Waiting {
    std::uint64_t tick = 0;
    std::vector<model::Vec3> positions;
  };

  std::optional<FrameCheck> check_;  // absent if the layout is impossible
  FrameFaults unknown_;              // frames without check_
  std::deque<Waiting> waiting_;
  std::uint64_t frames_ = 0;
  Difference largest_;
};

// Compares positions. NaN counts as the largest distance.
Difference differenceOf(std::uint64_t tick, const std::vector<model::Vec3>& was,
                        const std::vector<model::Vec3>& is);

}  // namespace clothstream::recording
