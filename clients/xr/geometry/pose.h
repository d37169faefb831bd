// SPDX-License-Identifier: MIT
// Rigid poses. Coordinates are right-handed with +Y up, in metres.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

namespace clothstream::xr {

// Leads from the coordinates of what has the pose to those in which the pose is given.
struct Pose {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();

  Eigen::Vector3f apply(const Eigen::Vector3f& point) const { return orientation * point + position; }
  // Direction in which -Z of the pose points, the forward direction of OpenXR.
  Eigen::Vector3f forward() const { return orientation * -Eigen::Vector3f::UnitZ(); }
};

// Applies `second` first.
inline Pose operator*(const Pose& first, const Pose& second) {
  return {first.apply(second.position), (first.orientation * second.orientation).normalized()};
}

inline Pose inverse(const Pose& pose) {
  const Eigen::Quaternionf back = pose.orientation.conjugate();
  return {back * -pose.position, back};
}

// Returns whether all numbers are finite and the orientation is no zero quaternion.
inline bool isPossible(const Pose& pose) {
  return pose.position.allFinite() && pose.orientation.coeffs().allFinite() && pose.orientation.norm() > 0.5f;
}

// Turn around the vertical of the direction of -Z, counter-clockwise seen from above, in radians. 0 if the
// direction is vertical.
inline float yawOf(const Eigen::Quaternionf& orientation) {
  const Eigen::Vector3f look = orientation * -Eigen::Vector3f::UnitZ();
  if (std::hypot(look.x(), look.z()) < 1e-3f) return 0;
  return std::atan2(-look.x(), -look.z());
}

}  // namespace clothstream::xr
