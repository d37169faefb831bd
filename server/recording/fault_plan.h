// SPDX-License-Identifier: MIT
// Faults of a played recording: which frames are lost or late. Used by tests of clients.
#pragma once

#include <chrono>
#include <cstdint>

namespace clothstream::recording {

// Frames with each fault, of 1000.
inline constexpr std::uint32_t kDropsIn1000 = 20, kDelaysIn1000 = 40, kStallsIn1000 = 4;
inline constexpr std::chrono::milliseconds kShortestDelay{5}, kLongestDelay{50};
inline constexpr std::chrono::milliseconds kShortestStall{200}, kLongestStall{500};

struct Fault {
  enum class Kind : std::uint8_t {
    none,
    drop,   // the frame is not sent
    delay,  // the frame, and what follows it, waits for `wait`
    stall,  // the same, for much longer
  };
  Kind kind = Kind::none;
  std::chrono::milliseconds wait{0};

  bool operator==(const Fault&) const = default;
};

// The fault of a frame depends only on the seed and the recorded tick of the frame. The same seed therefore
// gives the same faults on every machine, after each seek, and at every speed.
class FaultPlan {
 public:
  explicit FaultPlan(std::uint32_t seed) : seed_(seed) {}

  Fault at(std::uint64_t recordedTick) const;

 private:
  std::uint32_t seed_;
};

}  // namespace clothstream::recording
