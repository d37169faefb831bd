// SPDX-License-Identifier: MIT
// The user of a headset as colliders, hands and grabs of the scene.
#pragma once

#include <array>
#include <cstdint>

#include "clients/xr/input/grabber.h"
#include "clients/xr/input/own_input.h"

namespace clothstream::xr {

class Touch {
 public:
  static constexpr float kHeadRadius = 0.11f, kControllerRadius = 0.045f;  // m

  // Call once per frame, first. `toScene` leads from the room to the scene.
  void update(const InputSample& sample, const Pose& toScene, std::uint64_t nowUs);
  // The press of this limb belongs to something else, such as a panel: it takes hold of no cloth.
  void use(Side side) { used_[indexOf(side)] = true; }
  // Takes hold of the cloth with each limb whose press began in this frame and was not used.
  void grab(const Touchable& cloth);
  // Lets go of all cloth, for example because another scene follows.
  void letGo();
  // The server says that the grab has lost its cloth.
  void slipped(std::uint32_t grabId);
  // Removes the user from the scene: the session is not visible.
  void leave();

  // Input to send. Pointers in it are valid until the next call of a function that is not const.
  OwnInput input() const;

  const Limb& limb(Side side) const { return limbs_[indexOf(side)]; }
  const Grabber& grabber(Side side) const { return grabbers_[indexOf(side)]; }
  bool hasHead() const { return hasHead_; }
  // Head in scene coordinates.
  const Pose& head() const { return head_; }

 private:
  bool hasHead_ = false;
  Pose head_;
  std::array<Limb, kSides> limbs_{Limb(Side::left), Limb(Side::right)};
  std::array<Grabber, kSides> grabbers_;
  std::array<bool, kSides> used_{};
  std::uint32_t lastGrab_ = 0;
};

}  // namespace clothstream::xr
