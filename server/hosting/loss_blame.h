// SPDX-License-Identifier: MIT
// Finds the scene that makes the device be lost.
#pragma once

#include <optional>
#include <utility>

#include "server/schedule/clock.h"

namespace clothstream::hosting {

using schedule::Clock;

// Losses of the device while it worked on one scene: ran a tick of it, or loaded it. A scene is to blame if
// the device is lost twice within kWindow, the second time while it worked on this scene only. If it worked
// on several scenes both times, none of them is to blame, but each of them then works alone for kWindow.
// Belongs to one thread. Takes its time as an argument.
class LossBlame {
 public:
  static constexpr std::chrono::seconds kWindow{60};

  // The device was lost while it worked on this scene; `alone`: and on no other one.
  void count(Clock::time_point now, bool alone) {
    const bool again = newest_ && now - *newest_ < kWindow;
    if (again && alone) isToBlame_ = true;
    if (again && !alone) aloneUntil_ = now + kWindow;
    newest_ = now;
  }

  // Returns whether the scene became the one to blame since the last call.
  bool take() { return std::exchange(isToBlame_, false); }
  // Returns whether the device must not work on anything else while it works on this scene.
  bool isAlone(Clock::time_point now) const { return aloneUntil_ > now; }

 private:
  std::optional<Clock::time_point> newest_;
  bool isToBlame_ = false;
  Clock::time_point aloneUntil_{};
};

}  // namespace clothstream::hosting
