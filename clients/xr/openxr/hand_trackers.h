// SPDX-License-Identifier: MIT
// Joints of tracked hands (XR_EXT_hand_tracking).
#pragma once

#include <array>

#include "clients/xr/input/sample.h"
#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

class HandTrackers {
 public:
  // Without the extension or a headset that tracks hands, no hand is ever found.
  HandTrackers(const Instance& instance, XrSession session);
  ~HandTrackers();
  HandTrackers(const HandTrackers&) = delete;
  HandTrackers& operator=(const HandTrackers&) = delete;

  // Fills in the members of hands.
  void read(XrSpace room, XrTime time, std::array<LimbSample, kSides>& limbs) const;

 private:
  bool readOne(std::size_t side, XrSpace room, XrTime time, LimbSample& limb) const;

  PFN_xrLocateHandJointsEXT locate_ = nullptr;
  PFN_xrDestroyHandTrackerEXT destroy_ = nullptr;
  std::array<XrHandTrackerEXT, kSides> trackers_{};
};

}  // namespace clothstream::xr
