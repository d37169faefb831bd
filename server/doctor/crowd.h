// SPDX-License-Identifier: MIT
// Estimate of the number of equal scenes that a machine carries.
#pragma once

#include <cstdint>

#include "server/model/price.h"

namespace clothstream::doctor {

// Part of the time of the device and of the processors that scenes may take, so that there is room for the
// unexpected.
inline constexpr double kUsedShare = 0.8;

// Seconds that a tick of equal scenes takes. All scenes of a tick share its kernel calls.
struct CrowdCost {
  double sharedSeconds = 0;  // of the device, once for all scenes: kernel calls
  double ownSeconds = 0;     // of the device, for each scene: its nodes
  double frameSeconds = 0;   // of one processor, for each scene: entropy coding of a frame
};

CrowdCost costOf(const model::Work& work, const model::DeviceSpeed& speed, double frameSeconds);

struct Machine {
  unsigned processors = 1;
  bool software = false;  // the device computes on the processors too
};

struct CarriedScenes {
  std::uint32_t count = 0;
  bool byProcessors = false;  // the processors, not the device, are the limit
};

// Scenes with `rate` ticks and frames per second that take at most kUsedShare of the device's time and of the
// processors' time. Both times of a software device are those of the processors, and are added up. `cost`
// must have times above 0.
CarriedScenes carriedScenes(const CrowdCost& cost, const Machine& machine, double rate);

}  // namespace clothstream::doctor
