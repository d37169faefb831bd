// SPDX-License-Identifier: MIT
// Where the panel stands in the room.
#pragma once

#include "clients/xr/geometry/pose.h"

namespace clothstream::xr {

class PanelSeat {
 public:
  // The user was placed at this head pose: the panel stands to the left of the first look, nearer than the
  // scene, and faces the eyes.
  void seat(const Pose& head);
  // Trouble is shown in the direction of the look. It stays there until the user is seated again or
  // comeBack().
  void comeBefore(const Pose& head);
  void comeBack() { pose_ = seat_; }

  // The panel is here until the next call.
  void sit(const Pose& pose) { seat_ = pose_ = pose; }

  // Middle of the upper edge in the room.
  const Pose& pose() const { return pose_; }

 private:
  Pose seat_, pose_;
};

}  // namespace clothstream::xr
