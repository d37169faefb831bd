// SPDX-License-Identifier: MIT
// Feet that stand on the floor, and step when the body has moved away from them.
#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "clients/core/body/frame.h"

namespace clothstream::client::body {

// Place of a foot: its ankle, in the scene, and its heading, radians about +Y.
struct Foothold {
  Point ankle;
  double heading = 0;
};

class Footing {
 public:
  static constexpr double kStepSeconds = 0.3;
  static constexpr double kStepHeight = 0.06;  // m
  // A foot steps when it is this far from its place under the body, m, or turned away from it, radians.
  static constexpr double kFar = 0.18, kTurned = 0.7;

  // `homes` are the places under the body. One foot steps at a time, the one that is farther away.
  const std::array<Foothold, 2>& update(const std::array<Foothold, 2>& homes, double seconds);
  // The next update puts both feet to their places.
  void forget() { stands_ = false; }

 private:
  struct Foot {
    Foothold from;
    std::optional<double> stepped;  // seconds since it left the floor
  };

  bool stands_ = false;
  std::array<Foot, 2> feet_;
  std::array<Foothold, 2> now_;
};

}  // namespace clothstream::client::body
