// SPDX-License-Identifier: MIT
// Constraint enforcement on the device as [Va21] 3.2.2 has it: with the matrices written out.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/assembled/assembled_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// The baseline beside SolveStage, of cloths with model::isAssembled(): same constraints, same settings, same
// report, and the same motion as far as both converge and but for rounding. Belongs to the device's thread.
//
// A substep: J in CSR from where the nodes are; the matrix  J M^-1 J^T + c I,  whose entries' places follow
// from the cloth and are known ahead, row by row (SpMM); conjugate gradients with it (SpMV); and J^T, which
// is J in CSC, takes the multipliers to the nodes (SpMVT), which then collide. Every sum has one invocation
// and one order where the paper has atomic additions of floats, so that its bits do not depend on the device.
// It has no state of its own.
class AssembledStage {
 public:
  // Some cloth's system must be assembled. `workgroupSize` 0, and `wholeNodes` (of the largest cloth that one
  // workgroup solves) absent: the measured best for the device. Throws std::runtime_error where there is no
  // room.
  AssembledStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                 const StateBuffers& state, std::uint32_t workgroupSize,
                 std::optional<std::uint32_t> wholeNodes);

  static bool isIn(std::span<const model::Cloth> cloths);

  // Its tables, once, before the first substep.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep of so many seconds whose free motion leads from state `from` to the other; corrects the
  // latter in place. Begins with a barrier. `measures`: also what is left after the last iteration.
  void record(vulkan::Recorder& recorder, std::uint32_t from, const shared::CollisionPush& collision,
              double substepSeconds, bool measures) const;

  // Of the last substep that measures, a system: to the CPU, and there once the recording is complete. The
  // residual is SolveStage's.
  void recordReport(vulkan::Recorder& recorder) const;
  std::span<const shared::SolveRecord> report() const;

  // The cloth of each system.
  std::span<const std::uint32_t> cloths() const { return tables_.cloths; }

 private:
  // A kernel that does not see the state.
  struct Pass {
    Pass(const vulkan::Device& device, const vulkan::KernelDescription& description, Stage::Buffers buffers)
        : kernel(device, description), bindings(device, kernel, buffers) {}
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;

    vulkan::Kernel kernel;
    vulkan::Bindings bindings;  // they point to the kernel
  };

  void recordWhole(vulkan::Recorder& recorder, bool measures) const;
  void recordParts(vulkan::Recorder& recorder, bool measures) const;

  AssembledCut cut_;
  AssembledTables tables_;
  DeviceTable systems_, chunks_, rows_, entries_, columns_, sources_, nodeEntries_, nodeRows_, nodeRanges_;
  vulkan::Buffer blocks_, values_, vectors_, sums_, solves_, solvesReadback_;
  Stage fill_;
  Pass multiplyJacobians_;
  std::unique_ptr<Pass> solve_;              // where one workgroup solves a system
  std::unique_ptr<Pass> multiply_, update_;  // where several do
  Stage apply_;
};

}  // namespace clothstream::simulation
