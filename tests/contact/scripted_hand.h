// SPDX-License-Identifier: MIT
// A flat hand that moves on a given path.
#pragma once

#include <array>
#include <cstddef>

#include "clients/core/core.h"
#include "server/model/scene.h"

namespace clothstream::tests {

// Positions and radii of the joints {x, y, z, radius}, in the order of OpenXR.
using HandJoints = std::array<float, std::size_t{4} * CS_HAND_JOINTS>;

// A right hand, 19 cm long, with radii of 8 to 20 mm. `palm` is the middle of its palm. `fingers` points to
// the fingertips and `thumb` to the side of the thumb; both have length 1 and are perpendicular.
HandJoints flatHand(const model::Vec3& palm, const model::Vec3& fingers, const model::Vec3& thumb);

// Part of a straight way that a human movement of this duration has gone, 0 to 1 (Flash and Hogan 1985). Its
// highest speed is kPeakSpeed ways per `seconds`.
double smoothWay(double time, double seconds);
inline constexpr double kPeakSpeed = 1.875;

}  // namespace clothstream::tests
