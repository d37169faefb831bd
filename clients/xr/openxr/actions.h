// SPDX-License-Identifier: MIT
// Buttons, poses and vibration of controllers and hands, as actions of OpenXR.
#pragma once

#include <array>
#include <string>

#include "clients/xr/input/haptics.h"
#include "clients/xr/input/sample.h"
#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

class Actions {
 public:
  // Attaches to the session, so there is one object a session.
  Actions(const Instance& instance, XrSession session);
  ~Actions();
  Actions(const Actions&) = delete;
  Actions& operator=(const Actions&) = delete;

  // Reads buttons and poses for a display time. Without the input focus, no limb has a controller. Fills in
  // all members of the limbs except those of hands.
  void read(XrSpace room, XrTime time, std::array<LimbSample, kSides>& limbs);
  // Whether the button for recentring went down in the last read().
  bool recenters() const { return recenters_; }
  // Reads which profiles are active; call on XrEventDataInteractionProfileChanged.
  void profilesChanged();
  // Vibrates; a side without a controller is ignored.
  void vibrate(const Pulse& pulse);

 private:
  XrAction make(const char* name, const char* text, XrActionType type);
  void suggest();
  float valueOf(XrAction action, std::size_t side) const;

  const Instance& instance_;
  XrSession session_;
  XrActionSet set_ = XR_NULL_HANDLE;
  XrAction grip_ = XR_NULL_HANDLE, aim_ = XR_NULL_HANDLE, trigger_ = XR_NULL_HANDLE,
           squeeze_ = XR_NULL_HANDLE, recenter_ = XR_NULL_HANDLE, haptic_ = XR_NULL_HANDLE;
  std::array<XrPath, kSides> paths_{};
  std::array<XrSpace, kSides> gripSpaces_{}, aimSpaces_{};
  std::array<bool, kSides> isHandProfile_{};
  bool recenters_ = false;
};

// Pose of a space in another one at a time. Returns whether position and orientation are valid.
bool locate(XrSpace space, XrSpace base, XrTime time, Pose& out);
// Conversions.
Pose poseOf(const XrPosef& pose);
XrPosef xrPoseOf(const Pose& pose);

}  // namespace clothstream::xr
