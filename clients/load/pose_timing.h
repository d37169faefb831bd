// SPDX-License-Identifier: MIT
// Latency of a participant's poses until play-out first shows their effect, by stage.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace clothstream::load {

// Times in ms, one sample per pose. The stages add up to `whole`.
struct PoseTimes {
  std::vector<float> whole;  // from setting the pose to its first displayable frame
  std::vector<float> toTick, tickToPacket, packetToDecoded, decodedToDisplayable;

  void add(const PoseTimes& other);
};

// Times of the first frame that shows a pose, microseconds of the client's clock.
struct FrameTimes {
  double tick, packet, decoded, displayable;
};

// The server interpolates the positions of spheres but uses the radius of the newest pose at the tick. So
// each pose has a different radius, which identifies it in frames. Radii repeat after kNumbers poses.
class PoseTiming {
 public:
  // Radius for a pose that is set now: 0.047 to 0.048 m.
  float nextRadius(std::uint64_t nowUs);
  // Records a frame with this radius. It is the first to show every pose up to this one since the previous
  // call. Ignores other radii.
  void shown(float radius, const FrameTimes& frame, PoseTimes& out);

 private:
  static constexpr std::size_t kNumbers = 1024;

  std::array<std::uint64_t, kNumbers> setUs_{};
  std::uint64_t set_ = 0, shown_ = 0;  // number of poses so far
};

}  // namespace clothstream::load
