// SPDX-License-Identifier: MIT
// The scene of the suites that need a cloth in motion at any size: hung at the top, in wind, a sphere swings
// through it.
#pragma once

#include <cstdint>

#include "server/scene/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::bench {

// size x size nodes, 2 m x 2 m, ten substeps a tick, 72 ticks a second.
scene::Scene hungCloth(std::uint32_t size);

// The scene's environment, and the sphere as it moves during this tick.
simulation::TickInputs hungClothInputs(const scene::Scene& scene, std::uint64_t tick);

}  // namespace clothstream::bench
