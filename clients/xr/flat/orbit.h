// SPDX-License-Identifier: MIT
// A camera that turns around a point.
#pragma once

#include <Eigen/Core>

#include "clients/xr/geometry/pose.h"

namespace clothstream::xr {

class Orbit {
 public:
  static constexpr float kHalfAngle = 0.38F;  // of the picture's height, radians

  // Looks at a sphere from its front, a little from the side and from above, so that it fills the picture.
  void lookAt(const Eigen::Vector3f& centre, float radius, float aspect);
  // Distances are parts of the picture's height.
  void turn(const Eigen::Vector2f& moved);
  void pan(const Eigen::Vector2f& moved);
  void zoom(float steps);

  // Looks along -Z.
  Pose pose() const;
  // Direction, in the frame of the pose, of a place in the picture: -1 to 1, to the right and up. Of
  // length 1.
  static Eigen::Vector3f directionOf(const Eigen::Vector2f& place, float aspect);

 private:
  Eigen::Vector3f centre_ = Eigen::Vector3f(0, 1, -1);
  float distance_ = 3, nearest_ = 0.2F, farthest_ = 30;
  float yaw_ = 0, pitch_ = 0;  // radians; positive pitch looks down
};

}  // namespace clothstream::xr
