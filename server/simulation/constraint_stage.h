// SPDX-License-Identifier: MIT
// Implicit constraint enforcement on the device: cloths whose springs keep their length, always or where they
// are stretched too far.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/simulation/constraint_tables.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// How a solve is cut; the results do not depend on it.
struct SolveCut {
  std::uint32_t workgroupSize;
  std::uint32_t iterationsPerDispatch;
};

// Belongs to the device's thread. After the forces have given every node a free velocity and position, it
// solves
//   (J M^-1 J^T + compliance / h^2) lambda = C + h J v,   C = |x_b - x_a| - r, J at the substep's start,
// moves the nodes by -M^-1 J^T lambda and their velocities by as much over h ([Va21] Eq. 3-17), and lets them
// collide.
class ConstraintStage {
 public:
  // There must be a constraint. `workgroupSize` of a solve; 0: the measured best for the device.
  ConstraintStage(const vulkan::Device& device, const ConstraintTables& tables, const StateBuffers& state,
                  std::uint32_t workgroupSize);

  // Its tables, once, before the first substep.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep whose free motion leads from state `from` to the other; corrects the latter in place. Begins
  // with a barrier.
  // `iterations`: the most of any cloth.
  void record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
              shared::ConstraintPush push) const;

  // Of the tick's last substep, a system: to the CPU, and there once the recording is complete.
  void recordReport(vulkan::Recorder& recorder) const;
  std::span<const shared::SolveRecord> report() const;

 private:
  vulkan::Bindings prepareFrom(const vulkan::Device& device, const StateBuffers& state,
                               std::size_t from) const;
  vulkan::Bindings solveBindings(const vulkan::Device& device, const vulkan::Kernel& kernel,
                                 const StateBuffers& state) const;
  vulkan::Bindings applyTo(const vulkan::Device& device, const StateBuffers& state, std::size_t to) const;
  void recordSolve(vulkan::Recorder& recorder, const vulkan::Bindings& bindings, std::uint32_t firstSystem,
                   std::uint32_t systems, std::uint32_t iterations) const;

  struct Table {
    Table(const vulkan::Device& device, std::span<const std::byte> bytes);
    vulkan::Buffer upload, texels;
  };

  std::uint32_t linkCount_, nodeCount_, systemCount_, alwaysCount_;
  SolveCut cut_;
  Table systems_, links_, incidences_, lists_;
  vulkan::Buffer rows_, multipliers_, residuals_, directions_, products_, moves_, actives_, solves_,
      solvesReadback_;
  vulkan::Kernel prepare_, solveAll_, solveActive_, apply_;
  std::array<vulkan::Bindings, 2> prepareFrom_;
  vulkan::Bindings solveAllBindings_, solveActiveBindings_;
  std::array<vulkan::Bindings, 2> applyTo_;
};

}  // namespace clothstream::simulation
