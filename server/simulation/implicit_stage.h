// SPDX-License-Identifier: MIT
// Implicit Euler on the device: cloths whose springs pull as they will at the substep's end.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "server/simulation/implicit_tables.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. After the forces have given every node a free velocity and position, it
// solves
//   (M + h D + h^2 K) (v' - v) = M (v_free - v) - h^2 K v,   K, D at the substep's start,
// for the velocities v' that linearised implicit Euler gives (Baraff and Witkin, "Large steps in
// cloth simulation", 1998, Eq. 15-16), moves the nodes by h v', and lets them collide.
class ImplicitStage {
 public:
  // `workgroupSize` of a solve; 0: the measured best for the device. Throws std::runtime_error where the
  // device cannot take the springs.
  ImplicitStage(const vulkan::Device& device, const ImplicitTables& tables, const StateBuffers& state,
                std::uint32_t workgroupSize);
  ~ImplicitStage();

  // Other cloths, or none, are made ready; then they are taken from now on, with nothing of this stage in
  // flight. Kernels that were made are kept. Where the former throws, all is as before.
  void makeTables(const ImplicitTables& tables);
  void takeTables();
  // Whether there is an implicit cloth; nothing below may be called where there is none.
  bool active() const { return systems_ != nullptr; }

  // Its tables, before the first substep with them.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep whose free motion leads from state `from` to the other; corrects the latter in place. Begins
  // with a barrier. `iterations`: the most of any cloth.
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
  std::unique_ptr<Kernels> kernels_;      // from the first implicit cloth on
  std::unique_ptr<Systems> systems_;      // null where there are none
  std::unique_ptr<Kernels> nextKernels_;  // null: those that there are
  std::unique_ptr<Systems> nextSystems_;
};

}  // namespace clothstream::simulation
