// SPDX-License-Identifier: MIT
// Linear systems on the device: cloths with constraints (always, or if springs are stretched too far), and
// cloths with implicit Euler.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/solve_tables.h"
#include "server/simulation/solver_stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. The forces have given every node a free velocity and position. This stage
// solves for the change of the velocities (shaders/solve/spring_weight.glsl has the systems). It moves the
// nodes by h times that change and lets them collide. Several workgroups solve a large cloth, with one or two
// dispatches per iteration; these are empty after all systems have converged. The bits are those of a solve
// by one workgroup.
class SolveStage final : public SolverStage {
 public:
  // Starts without systems. `workgroupSize` 0 and `wholeNodes` absent (nodes of the largest cloth that one
  // workgroup solves) mean the measured best for the device.
  SolveStage(const vulkan::Device& device, const StateBuffers& state, std::uint32_t workgroupSize,
             std::optional<std::uint32_t> wholeNodes);
  ~SolveStage() override;

  // Everything whose size follows from the cloths.
  struct Systems;
  // Makes the systems of these cloths; null if there are none. Kernels are kept. Throws std::runtime_error
  // and changes nothing if the device cannot take the systems.
  std::shared_ptr<Systems> makeSystems(std::span<const model::Cloth> cloths);
  // Makes them current. No work of this stage may be in flight.
  void use(std::shared_ptr<Systems> systems);
  // True if there is a system.
  bool active() const { return systems_ != nullptr; }

  // Corrects the free motion in place.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;
  std::span<const shared::SolveRecord> report() const override;
  std::span<const std::uint32_t> cloths() const override;

  // Marks the springs that ACAD held in the last recorded substep, if a cloth has it. Begins with a barrier.
  // There must be a system.
  void recordActiveSprings(vulkan::Recorder& recorder);
  // Ends of these springs once the recording is complete: ActiveSprings::collect().
  void activeSprings(std::size_t most, std::span<std::vector<std::uint32_t>> ofCloths) const;

  // Workgroups that look for stretched springs of the grids that follow these forces; 0 unless `follow` is a
  // mode of acad.
  std::uint32_t stretchGroups(Follow follow) const;

 private:
  struct Kernels;

  void recordTables(vulkan::Recorder& recorder) override;

  const vulkan::Device& device_;
  StateBuffers state_;
  std::unique_ptr<Kernels> kernels_;  // created at their first use
  std::shared_ptr<Systems> systems_;  // null if there is no system
};

}  // namespace clothstream::simulation
