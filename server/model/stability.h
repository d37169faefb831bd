// SPDX-License-Identifier: MIT
// The largest time step that explicit integration of a cloth's springs survives.
#pragma once

#include <cstdint>

#include "server/model/scene.h"

namespace clothstream::model {

inline constexpr std::uint32_t kMaxSubsteps = 256;

// Speeds of the cloth against still air up to which the bound counts the air's damping, m/s.
inline constexpr float kAirSpeed = 10;

// Stretch up to which the bound of explicit Euler counts the springs' tension; beyond it [Va21] 3.3 calls a
// spring overstretched.
inline constexpr float kTensionStrain = 0.1f;

// Fewest substeps a tick (1 to kMaxSubsteps) with which every cloth of the scene is integrated stably by the
// scene's integrator at the scene's simulation rate; 0 if not even kMaxSubsteps would do. For semi-implicit
// Euler it is a bound, not an estimate: it holds for every shape of the cloth (Gershgorin's circles over M^-1
// K and M^-1 C; the derivation is in the .cpp). Explicit Euler always needs a cloth's `damping` too: dashpots
// act along springs only, and it blows up whatever moves across them.
std::uint32_t stableSubsteps(const Scene& scene);

}  // namespace clothstream::model
