// SPDX-License-Identifier: MIT
// Converts display times of an OpenXR runtime to the clock of the client.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace clothstream::xr {

// Times of a runtime (XrTime) are nanoseconds of a clock that the standard leaves open. Runtimes with
// XR_KHR_convert_timespec_time say what they are on CLOCK_MONOTONIC, which is the client's clock. For others
// the offset is estimated: a frame that begins on time is displayed two periods later.
class DisplayClock {
 public:
  // Call once per frame, after xrWaitFrame has returned at `nowUs`. Returns the display time on the clock of
  // the client, at least `nowUs` and at most 100 ms later. `predictedNs` and `periodNs` are those of the
  // frame; a period that is not positive means 90 Hz.
  std::uint64_t displayUs(std::int64_t predictedNs, std::int64_t periodNs, std::uint64_t nowUs);
  // The same with the display time that the runtime has converted, in nanoseconds of CLOCK_MONOTONIC.
  static std::uint64_t convertedUs(std::int64_t monotonicNs, std::uint64_t nowUs);

  static constexpr std::uint64_t kLongestLeadUs = 100'000;

 private:
  // Offsets of the newest frames: predicted display time less the time at which its frame began, ns. The
  // largest belongs to a frame that began without delay.
  static constexpr std::size_t kFrames = 90;
  std::array<std::int64_t, kFrames> leads_{};
  std::size_t count_ = 0, next_ = 0;
};

}  // namespace clothstream::xr
