// SPDX-License-Identifier: MIT
// Poses and buttons of the user of a headset at one display time.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "clients/xr/geometry/pose.h"
#include "proto/hands/bones.h"

namespace clothstream::xr {

enum class Side : std::uint8_t { left, right };
inline constexpr std::size_t kSides = 2;
inline constexpr std::size_t indexOf(Side side) {
  return static_cast<std::size_t>(side);
}

struct HandJoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  float radius = 0;  // m
};
// Joints in the order of XrHandJointEXT.
using HandJoints = std::array<HandJoint, hands::kJoints>;

// One side of the user, in coordinates of the room.
struct LimbSample {
  // A controller whose pose is known. grip: its middle. aim: it points along -Z.
  bool hasController = false;
  Pose grip;
  // Also without a controller: runtimes can have a ray for hands.
  bool hasAim = false;
  Pose aim;
  float trigger = 0, squeeze = 0;  // 0 (released) to 1 (pressed)
  // A hand whose joints are all known.
  bool hasHand = false;
  HandJoints joints;
  Eigen::Quaternionf wrist = Eigen::Quaternionf::Identity();
};

struct InputSample {
  bool hasHead = false;
  Pose head;  // between the eyes; looks along -Z
  std::array<LimbSample, kSides> limbs;
};

}  // namespace clothstream::xr
