// SPDX-License-Identifier: MIT
#include "server/doctor/crowd.h"

#include <algorithm>

namespace clothstream::doctor {

CrowdCost costOf(const model::Work& work, const model::DeviceSpeed& speed, double frameSeconds) {
  const model::Work calls{.gpuDispatches = work.gpuDispatches, .dispatches = work.dispatches};
  const double shared = calls.seconds(speed);
  return {.sharedSeconds = shared, .ownSeconds = work.seconds(speed) - shared, .frameSeconds = frameSeconds};
}

CarriedScenes carriedScenes(const CrowdCost& cost, const Machine& machine, double rate) {
  const double tick = kUsedShare / rate;
  const double frame = cost.frameSeconds / machine.processors;
  const double room = std::max(0.0, tick - cost.sharedSeconds);
  const double byDevice = room / (cost.ownSeconds + (machine.software ? frame : 0));
  const double byProcessors = tick / frame;
  return {.count = static_cast<std::uint32_t>(std::min({byDevice, byProcessors, 1e9})),
          .byProcessors = machine.software || byProcessors < byDevice};
}

}  // namespace clothstream::doctor
