// SPDX-License-Identifier: MIT
// Largest time step with which explicit integration of a cloth is stable.
#pragma once

#include <cstdint>

#include "server/model/scene.h"

namespace clothstream::model {

inline constexpr std::uint32_t kMaxSubsteps = 256;

// Maximum speed of the cloth in still air for which the bound includes air damping, m/s.
inline constexpr float kAirSpeed = 10;

// Maximum stretch for which the bound of explicit Euler includes spring tension. [Va21] 3.3 calls a spring
// overstretched beyond it.
inline constexpr float kTensionStrain = 0.1f;

// Minimum number of substeps per tick, 1 to kMaxSubsteps, with which the scene's integrator is stable for
// every cloth at the scene's simulation rate. 0 if kMaxSubsteps are not enough. For semi-implicit Euler this
// is a bound, not an estimate: it holds for every shape of the cloth. The .cpp derives it with Gershgorin's
// circle theorem for M^-1 K and M^-1 C. Explicit Euler always needs Cloth::damping too: dashpots act along
// springs only, and motion across them is unstable.
std::uint32_t stableSubsteps(const Scene& scene);

}  // namespace clothstream::model
