// SPDX-License-Identifier: MIT
// How long a participant's poses take until play-out shows something of them, stage by stage.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace clothstream::load {

// ms, one of each a pose; the stages add up to the whole.
struct PoseTimes {
  std::vector<float> whole;  // from when it is set to when its frame is first displayable
  std::vector<float> toTick, tickToPacket, packetToDecoded, decodedToDisplayable;

  void add(const PoseTimes& other);
};

// Of the first frame that shows a pose; microseconds of the own clock.
struct FrameTimes {
  double tick, packet, decoded, displayable;
};

// The server moves spheres between and beyond their poses, but their size is that of the newest pose which is
// true at the tick. So each pose has a size of its own, by which its frame is known. Sizes repeat after
// kNumbers poses.
class PoseTiming {
 public:
  // Of a pose that is set now, m: 47 mm and up to 1 mm more.
  float nextRadius(std::uint64_t nowUs);
  // A frame shows the sphere with this radius: every pose since the one that was shown before is first shown
  // in it, itself or by a newer one. Radii that are none of those above are left aside.
  void shown(float radius, const FrameTimes& frame, PoseTimes& out);

 private:
  static constexpr std::size_t kNumbers = 1024;

  std::array<std::uint64_t, kNumbers> setUs_{};
  std::uint64_t set_ = 0, shown_ = 0;  // poses so far
};

}  // namespace clothstream::load
