// SPDX-License-Identifier: MIT
#include "clients/xr/input/placement.h"

namespace clothstream::xr {

void Placement::placeBefore(const Pose& head, const SceneBounds& bounds) {
  const float yaw = yawOf(head.orientation);
  toRoom_.orientation = Eigen::AngleAxisf(yaw, Eigen::Vector3f::UnitY());
  const Eigen::Vector3f look = toRoom_.orientation * -Eigen::Vector3f::UnitZ();
  const Eigen::Vector3f front((bounds.least.x() + bounds.most.x()) / 2, bounds.least.y(), bounds.most.z());
  const Eigen::Vector3f at = Eigen::Vector3f(head.position.x(), 0, head.position.z()) + kArmLength * look;
  toRoom_.position = at - toRoom_.orientation * front;
  toScene_ = inverse(toRoom_);
}

}  // namespace clothstream::xr
