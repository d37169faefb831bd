// SPDX-License-Identifier: MIT
// A solver of the springs on the device.
#pragma once

#include <cstdint>
#include <span>

#include "server/simulation/stage.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// In each substep it corrects, in place, the free motion that the forces have given the nodes.
class SolverStage : public Stage {
 public:
  // Creates the kernels that cloths with these records need now instead of at their first use.
  virtual void prepare(std::span<const shared::ClothRecord>) {}

  // Returns what the last substep of the last recorded tick has solved, one record for each system, once the
  // tick is complete. It is empty if the solver has no systems.
  virtual std::span<const shared::SolveRecord> report() const { return {}; }
  // The cloth of each system.
  virtual std::span<const std::uint32_t> cloths() const { return {}; }
};

}  // namespace clothstream::simulation
