// SPDX-License-Identifier: MIT
// Samples of hands and controllers for tests of the input.
#pragma once

#include "clients/xr/input/sample.h"

namespace clothstream::xr {

inline constexpr float kPi = 3.14159265f;
inline constexpr std::size_t kThumbTip = 5, kIndexTip = 10;

// Tips of thumb and index finger at the given distance (m); all other joints around `at`.
inline void giveHand(LimbSample& limb, const Eigen::Vector3f& at, float tipDistance) {
  limb.hasHand = true;
  for (std::size_t i = 0; i < limb.joints.size(); ++i)
    limb.joints[i] = {at + Eigen::Vector3f(0, 0.001f * static_cast<float>(i), 0.05f), 0.008f};
  limb.joints[kThumbTip].position = at - Eigen::Vector3f(tipDistance / 2, 0, 0);
  limb.joints[kIndexTip].position = at + Eigen::Vector3f(tipDistance / 2, 0, 0);
}

inline void giveController(LimbSample& limb, const Eigen::Vector3f& at) {
  limb.hasController = limb.hasAim = true;
  limb.grip.position = limb.aim.position = at;
}

}  // namespace clothstream::xr
