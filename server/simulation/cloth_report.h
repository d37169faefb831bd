// SPDX-License-Identifier: MIT
// What a cloth is like at a tick's end, whatever its solver.
#pragma once

#include <cstdint>

namespace clothstream::simulation {

struct ClothReport {
  // Stretch of the structural springs, |d| / L - 1: the largest; that which 99 % of them do not exceed, at
  // most 1/32 (or 1e-6) too large; and the mean of the absolute values.
  float strainMax = 0, strainP99 = 0, strainMean = 0;
  // J. Kinetic and gravity's of the nodes that can move, gravity's 0 at the origin; elastic of all springs by
  // their stiffness, whether they are forces or constraints.
  float kineticEnergy = 0, elasticEnergy = 0, gravityEnergy = 0;
  // m below a collider's surface (not counting the cloth's thickness), of the nodes that can move; 0: none is
  // in one.
  float penetration = 0;
  // Of the last substep's solve; 0 where springs are forces.
  std::uint32_t activeConstraints = 0, iterations = 0;
  float residual = 0;  // its norm, relative to where the solve started
};

}  // namespace clothstream::simulation
