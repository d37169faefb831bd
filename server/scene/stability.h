// SPDX-License-Identifier: MIT
// The largest time step that explicit integration of a cloth's springs survives.
#pragma once

#include <cstdint>

#include "server/scene/scene.h"

namespace clothstream::scene {

// Fewest substeps a tick (1 to 256) with which every cloth of the scene is integrated stably by the scene's
// integrator at the scene's simulation rate; 0 if not even 256 would do. A bound, not an estimate: it holds for
// every shape of the cloth (Gershgorin's circles over M^-1 K and M^-1 C; the derivation is in the .cpp).
std::uint32_t stableSubsteps(const Scene& scene);

}  // namespace clothstream::scene
