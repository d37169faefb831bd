// SPDX-License-Identifier: MIT
// Scenes that several suites have.
#pragma once

#include <cstdint>

#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::bench {

// A cloth in motion at any size: hung at the top, in wind, a sphere swings through it.
// size x size nodes, 2 m x 2 m, ten substeps a tick, 72 ticks a second.
model::Scene hungCloth(std::uint32_t size);

// The scene's environment, and the sphere as it moves during this tick.
simulation::TickInputs hungClothInputs(const model::Scene& scene, std::uint64_t tick);

// A square metre of 0.2 kg, hung by its upper edge, without springs; what it is solved by is for the suite to
// say.
model::Scene hungSheet(std::uint32_t size, const model::Solver& solver, std::uint32_t substeps);

// Makes it one substep that is solved to the end, to be compared with the reference; returns by how much
// nodes may be off, m. With A = c M + J^T J of what is solved, c M 0.01 of it, and rho = A e what is left,
// nodes are off by |e| <= 100 |rho|; and |rho| is the tolerance times |J^T b| <= 5 |b|, b being as long as
// nodes were displaced.
double solveToTheEnd(model::Scene& sheet);

}  // namespace clothstream::bench
