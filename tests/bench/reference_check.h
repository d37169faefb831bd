// SPDX-License-Identifier: MIT
// Comparison of a scene on the device with the double-precision reference, before its times are reported.
#pragma once

#include <cstdint>

#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"

namespace clothstream::bench {

// Compares the device with the reference, for a scene with one cloth.
// - mass-spring: the nodes after one tick, with its coarse correction. The others are compared without it.
// - xpbd: the nodes after one substep.
// - constraint and acad: the nodes after one substep that is solved to the end, with the default compliance
// of
//   the constraint solver; for acad's mode limit with its own.
// - implicit Euler: the residual that the device's solution leaves in the reference's system. This is sharp
//   even if the system is ill-conditioned, where distances are not.
// - constraint with a compliance: also this residual, with the scene's own settings, if there are no
// colliders. Starts from a displaced state without colliders. Throws std::runtime_error, which names the
// cloth's solver, if they differ by more than the solve and float rounding explain. Returns the iterations of
// the solve, or 0 for a solver that does not report them.
std::uint32_t checkWithReference(vulkan::Device& device, const model::Scene& scene,
                                 const simulation::SimulationOptions& options);

// The same from `start` and with `inputs`, which have no colliders for implicit Euler.
std::uint32_t checkWithReference(vulkan::Device& device, const model::Scene& scene,
                                 const simulation::SimulationOptions& options,
                                 const simulation::NodeState& start, const simulation::TickInputs& inputs);

}  // namespace clothstream::bench
