// SPDX-License-Identifier: MIT
// Implicit constraint enforcement on the device: cloths whose springs keep their length, always or where they
// are stretched too far.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/simulation/constraint_tables.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. After the forces have given every node a free velocity and position, it
// solves
//   (J M^-1 J^T + compliance / h^2) lambda = C + h J v,   C = |x_b - x_a| - r, J at the substep's start,
// moves the nodes by -M^-1 J^T lambda and their velocities by as much over h ([Va21] Eq. 3-17), and lets them
// collide.
class ConstraintStage {
 public:
  // `workgroupSize` of a solve; 0: the measured best for the device. Throws std::runtime_error where the
  // device cannot take the constraints.
  ConstraintStage(const vulkan::Device& device, const ConstraintTables& tables, const StateBuffers& state,
                  std::uint32_t workgroupSize);
  ~ConstraintStage();

  // Other constraints, or none, are made ready; then they are taken from now on, with nothing of this stage
  // in flight. Kernels that were made are kept. Where the former throws, all is as before.
  void makeTables(const ConstraintTables& tables);
  void takeTables();
  // Whether there is a constraint; nothing below may be called where there is none.
  bool active() const { return systems_ != nullptr; }

  // Its tables, before the first substep with them.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep whose free motion leads from state `from` to the other; corrects the latter in place. Begins
  // with a barrier.
  // `iterations`: the most of any cloth.
  void record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
              shared::ConstraintPush push) const;

  // Of the tick's last substep, a system: to the CPU, and there once the recording is complete.
  void recordReport(vulkan::Recorder& recorder) const;
  std::span<const shared::SolveRecord> report() const;

  // The cloth of each system.
  std::span<const std::uint32_t> cloths() const;

 private:
  struct Kernels;
  struct Systems;

  const vulkan::Device& device_;
  StateBuffers state_;
  std::uint32_t workgroupSize_;
  std::unique_ptr<Kernels> kernels_;      // from the first constraint on
  std::unique_ptr<Systems> systems_;      // null where there are none
  std::unique_ptr<Kernels> nextKernels_;  // null: those that there are
  std::unique_ptr<Systems> nextSystems_;
};

}  // namespace clothstream::simulation
