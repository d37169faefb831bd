// SPDX-License-Identifier: MIT
// A button made of a continuous value. Two limits keep a trembling hand from releasing it.
#pragma once

namespace clothstream::xr {

class Hysteresis {
 public:
  // The button is pressed from `pressAt` on, and released below `releaseAt`, which is smaller.
  constexpr Hysteresis(float pressAt, float releaseAt) : pressAt_(pressAt), releaseAt_(releaseAt) {}

  // Returns whether the button is pressed. A value that is not a number releases it.
  constexpr bool update(float value) {
    pressed_ = value >= (pressed_ ? releaseAt_ : pressAt_);
    return pressed_;
  }
  constexpr void release() { pressed_ = false; }
  constexpr bool pressed() const { return pressed_; }

 private:
  float pressAt_, releaseAt_;
  bool pressed_ = false;
};

}  // namespace clothstream::xr
