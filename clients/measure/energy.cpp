// SPDX-License-Identifier: MIT
#include "clients/measure/energy.h"

namespace clothstream::measure {

double kineticEnergy(std::span<const double> masses, std::uint32_t first, std::span<const float> before,
                     std::span<const float> after, double seconds) {
  double energy = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const Point was = pointAt(before, first + i), is = pointAt(after, first + i);
    double square = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double velocity = (is[axis] - was[axis]) / seconds;
      square += velocity * velocity;
    }
    energy += 0.5 * masses[i] * square;
  }
  return energy;
}

double gravityEnergy(std::span<const double> masses, std::uint32_t first, std::span<const float> positions,
                     const Point& gravity) {
  double energy = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const Point point = pointAt(positions, first + i);
    energy -= masses[i] * (gravity[0] * point[0] + gravity[1] * point[1] + gravity[2] * point[2]);
  }
  return energy;
}

}  // namespace clothstream::measure
