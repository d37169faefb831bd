// SPDX-License-Identifier: MIT
// Kinetic and gravitational energy from positions and masses.
#pragma once

#include <span>

#include "clients/measure/surface.h"

namespace clothstream::measure {

// 1/2 m |v|^2 of the vertices `first` and following, one for each mass, J. The velocity is the central
// difference (after - before) / seconds. Positions have 3 floats per vertex.
double kineticEnergy(std::span<const double> masses, std::uint32_t first, std::span<const float> before,
                     std::span<const float> after, double seconds);

// -m g x, which is 0 at the origin, J. `gravity` is an acceleration, m/s^2.
double gravityEnergy(std::span<const double> masses, std::uint32_t first, std::span<const float> positions,
                     const Point& gravity);

}  // namespace clothstream::measure
