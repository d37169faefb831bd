// SPDX-License-Identifier: MIT
// Space of the room: its floor is at y = 0, and its origin is where the user began or was recentred.
#pragma once

#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

// Uses LOCAL_FLOOR (XR_EXT_local_floor) where the runtime has it. Otherwise it is LOCAL, moved down to the
// floor of STAGE; without a STAGE, by the height of the eyes of a person who stands.
class RoomSpace {
 public:
  RoomSpace(const Instance& instance, XrSession session);
  ~RoomSpace();
  RoomSpace(const RoomSpace&) = delete;
  RoomSpace& operator=(const RoomSpace&) = delete;

  // Call once per frame: the floor of STAGE is known only once frames run, and changes when the user is
  // recentred.
  void update(XrTime time);
  // The runtime has moved its spaces.
  void changed() { findsFloor_ = stage_ != XR_NULL_HANDLE; }

  XrSpace get() const { return room_; }
  XrSpace view() const { return view_; }

 private:
  void make(XrReferenceSpaceType type, float height, XrSpace& space);

  static constexpr float kEyes = 1.6f;  // m
  XrSession session_;
  XrSpace room_ = XR_NULL_HANDLE, view_ = XR_NULL_HANDLE, local_ = XR_NULL_HANDLE, stage_ = XR_NULL_HANDLE;
  bool findsFloor_ = false;
};

}  // namespace clothstream::xr
