// SPDX-License-Identifier: MIT
// Where the scene of the server stands in the user's room.
#pragma once

#include "clients/xr/geometry/pose.h"

namespace clothstream::xr {

// Box of cloths and colliders in the scene, whose lower face is on the floor.
struct SceneBounds {
  Eigen::Vector3f least = Eigen::Vector3f(-0.5f, 0, -0.5f), most = Eigen::Vector3f(0.5f, 1.5f, 0.5f);
};

class Placement {
 public:
  // Distance from the user to the front of the scene when it is placed, m.
  static constexpr float kArmLength = 0.5f;

  // Puts the front of the scene before the user, on the floor of the room. `head` is in the room, whose floor
  // is at y = 0.
  void placeBefore(const Pose& head, const SceneBounds& bounds);

  const Pose& toRoom() const { return toRoom_; }
  const Pose& toScene() const { return toScene_; }

 private:
  Pose toRoom_, toScene_;
};

}  // namespace clothstream::xr
