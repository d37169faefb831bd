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

// Reduces the scene to one substep that is solved to the end, for comparison with the reference. Returns the
// allowed distance of nodes in metres.
// With A = c M + J^T J of the solved system, c M 0.01 of it, and rho = A e the remainder, |e| <= 100 |rho|.
// |rho| is the tolerance times |J^T b| <= 5 |b|, and |b| is the displacement of the nodes.
double solveToTheEnd(model::Scene& sheet);

}  // namespace clothstream::bench
