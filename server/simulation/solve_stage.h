// SPDX-License-Identifier: MIT
// Linear systems on the device: cloths whose springs keep their length, always or where they are stretched
// too far, and cloths whose springs pull as they will at the substep's end.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/solve_tables.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. After the forces have given every node a free velocity and position, it
// solves for what the velocities change by (shaders/solve/spring_terms.glsl has the systems), moves the nodes by as
// much times h, and lets them collide. Large cloths are solved by several workgroups in a dispatch or two an
// iteration, which are empty once all have converged; the bits are those of one workgroup.
class SolveStage {
 public:
  // `workgroupSize` 0, and `wholeNodes` (of the largest cloth that one workgroup solves) absent: the measured
  // best for the device. Throws std::runtime_error where the device cannot take the systems.
  SolveStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
             std::uint32_t workgroupSize, std::optional<std::uint32_t> wholeNodes);
  ~SolveStage();

  // Other cloths, or none, are made ready; then they are taken from now on, with nothing of this stage in
  // flight. Kernels that were made are kept. Where the former throws, all is as before.
  void makeTables(std::span<const model::Cloth> cloths);
  void takeTables();
  // Whether there is a system; nothing below may be called where there is none.
  bool active() const { return systems_ != nullptr; }

  // Its tables, before the first substep with them.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep of so many seconds whose free motion leads from state `from` to the other; corrects the
  // latter in place. Begins with a barrier.
  void record(vulkan::Recorder& recorder, std::uint32_t from, const shared::CollisionPush& collision,
              double substepSeconds) const;

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
  std::uint32_t workgroupSize_, wholeNodes_;
  std::unique_ptr<Kernels> kernels_;  // made when they are first needed
  std::unique_ptr<Systems> systems_;  // null where there are none
  std::unique_ptr<Systems> nextSystems_;
};

}  // namespace clothstream::simulation
