// SPDX-License-Identifier: MIT
// Constraint enforcement on the device with assembled matrices, [Va21] 3.2.2.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/assembled/assembled_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/solver_stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Solves the constraints of cloths with model::isAssembled(), as a baseline for SolveStage. Constraints,
// settings and report are the same. The motion agrees up to convergence and rounding. Belongs to the device's
// thread.
//
// A substep fills J in CSR format from the nodes' positions, then the matrix J M^-1 J^T + c I row by row
// (SpMM); the places of its entries follow from the cloth. Conjugate gradients solve with it (SpMV). J^T,
// which is J in CSC format, moves the nodes by the multipliers (SpMVT), and the nodes collide. The paper adds
// floats atomically; here each sum has one invocation and one order, so that its bits do not depend on the
// device. The stage keeps no state between substeps.
class AssembledStage final : public SolverStage {
 public:
  // At least one cloth must be assembled. `workgroupSize` 0 and `wholeNodes` absent (nodes of the largest
  // cloth that one workgroup solves) mean the measured best for the device. Throws std::runtime_error if the
  // device has too little memory.
  AssembledStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                 const StateBuffers& state, std::uint32_t workgroupSize,
                 std::optional<std::uint32_t> wholeNodes);

  static bool isIn(std::span<const model::Cloth> cloths);

  // Corrects the free motion in place.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;
  // The residual is defined as in SolveStage.
  std::span<const shared::SolveRecord> report() const override;
  std::span<const std::uint32_t> cloths() const override { return tables_.cloths; }

 private:
  void recordTables(vulkan::Recorder& recorder) override;
  // `measures`: also measure the residual after the last iteration.
  void recordWhole(vulkan::Recorder& recorder, bool measures) const;
  void recordParts(vulkan::Recorder& recorder, bool measures) const;

  AssembledCut cut_;
  AssembledTables tables_;
  DeviceTable systems_, chunks_, rows_, entries_, columns_, sources_, nodeEntries_, nodeRows_, nodeRanges_;
  vulkan::Buffer blocks_, values_, vectors_, sums_, solves_, solvesReadback_;
  StateBindings fill_;
  vulkan::Bindings multiplyJacobians_;
  std::optional<vulkan::Bindings> solve_;              // if one workgroup solves a system
  std::optional<vulkan::Bindings> multiply_, update_;  // if several workgroups solve a system
  StateBindings apply_;
};

}  // namespace clothstream::simulation
