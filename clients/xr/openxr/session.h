// SPDX-License-Identifier: MIT
// A session of OpenXR and the states that the runtime gives it.
#pragma once

#include <optional>

#include "clients/xr/openxr/graphics.h"
#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

// Changes that the events since the last call ask for.
struct SessionChanges {
  bool restarts = false;         // instance or session are lost: make everything again
  bool exits = false;            // the user has closed the program
  bool profilesChanged = false;  // other controllers, or hands
  // Times from which the origin of LOCAL is elsewhere, because the user was recentred, and from which the
  // floor is that of another STAGE.
  std::optional<XrTime> originMoves, floorMoves;
};

class Session {
 public:
  Session(const Instance& instance, const Graphics& graphics);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  XrSession get() const { return session_; }
  // Begins and ends the session as the runtime asks, and logs all changes of state.
  SessionChanges poll();
  // Frames must be waited for, begun and ended.
  bool isRunning() const { return isRunning_; }
  // Input belongs to this program.
  bool hasFocus() const { return state_ == XR_SESSION_STATE_FOCUSED; }
  // Asks the runtime to end the session; poll() reports `exits` when it has. Returns false if the session
  // does not run, so that nothing follows.
  bool requestExit();

 private:
  void changeState(XrSessionState state, SessionChanges& changes);

  XrInstance instance_;
  XrSession session_ = XR_NULL_HANDLE;
  XrSessionState state_ = XR_SESSION_STATE_UNKNOWN;
  bool isRunning_ = false;
};

}  // namespace clothstream::xr
