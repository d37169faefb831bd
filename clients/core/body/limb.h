// SPDX-License-Identifier: MIT
// Two bones with a hinge between them that reach for a point: an arm or a leg.
#pragma once

#include <optional>

#include "clients/core/body/frame.h"

namespace clothstream::client::body {

struct LimbLengths {
  double upper = 0, lower = 0;  // m
};

// Largest and smallest distance between the ends of a limb. Near full extension the hinge would turn without
// bound while the end moves a little, so the limb stays bent by about 6 degrees; it misses what is at its
// full length by 0.15 % of the length. The hinge closes to 20 degrees.
double farthestReach(const LimbLengths& lengths);
double nearestReach(const LimbLengths& lengths);

struct LimbPose {
  Point hinge, end;
};

// The limb from `root` towards `target`, with the hinge on the side of `pole`, a unit vector that is
// perpendicular to the way. `end` is the point on the way that the limb reaches.
LimbPose bend(const Point& root, const Point& target, const Point& way, const Point& pole,
              const LimbLengths& lengths);

// Side of the hinge of an arm, from one update to the next. It never flips:
//
// - While the way from shoulder to hand turns, the side turns with it by the smallest rotation. This is
//   continuous for every way except one that is reversed within one update.
// - The preferred side then draws it about the way, at most kSwivelRate times the sine of the angle between
//   way and preference. At the singular way, along the preference, the preferred side changes at once, and
//   the speed is 0.
class HingeSide {
 public:
  // Radians per second.
  static constexpr double kSwivelRate = 4;

  // All vectors are in one frame that moves with the torso; `way` has length 1. Returns the side,
  // perpendicular to it.
  Point update(const Point& way, const Point& preferred, double seconds);
  // The next update begins at the preferred side.
  void forget() { side_.reset(); }

 private:
  std::optional<Point> side_;
  Point way_;
};

}  // namespace clothstream::client::body
