// SPDX-License-Identifier: MIT
// Measured values of a cloth at a tick's end, for every solver.
#pragma once

#include <cstddef>
#include <cstdint>

namespace clothstream::simulation {

// Most springs that one report names.
inline constexpr std::size_t kMostNamedConstraints = 16'384;

struct ClothReport {
  // Stretch |d| / L - 1 of the structural springs: the largest; the value that 99 % of them do not exceed (at
  // most 1/32, or 1e-6, too large); the mean of the absolute values.
  float strainMax = 0, strainP99 = 0, strainMean = 0;
  // J. Kinetic energy and gravity energy (0 at the origin) of free nodes; elastic energy of all springs by
  // their stiffness, also of springs that are constraints.
  float kineticEnergy = 0, elasticEnergy = 0, gravityEnergy = 0;
  // Largest depth of a free node below a collider's surface, m, without the cloth's thickness. 0: no node is
  // inside.
  float penetration = 0;
  // Values of the last substep's solve; 0 if the springs are forces.
  std::uint32_t activeConstraints = 0, iterations = 0;
  float residual = 0;  // its norm, relative to where the solve started
};

}  // namespace clothstream::simulation
