// SPDX-License-Identifier: MIT
// Scenes that several suites use.
#pragma once

#include <cstdint>

#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::bench {

// A moving cloth of any size: hung at the top, in wind, with a sphere that swings through it. size x size
// nodes on 2 m x 2 m, ten substeps a tick, 72 ticks a second.
model::Scene hungCloth(std::uint32_t size);

// The scene's environment and the moving sphere of this tick.
simulation::TickInputs hungClothInputs(const model::Scene& scene, std::uint64_t tick);

// A square metre of 0.2 kg, hung by its upper edge, without springs. The suite chooses the solver.
model::Scene hungSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps);

// The same sheet, which starts level and swings down from two corners. 60 ticks a second.
model::Scene swingingSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps);

}  // namespace clothstream::bench
