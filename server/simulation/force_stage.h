// SPDX-License-Identifier: MIT
// Forces of all cloths, and their integration over a substep.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/advance_variant.h"
#include "server/simulation/grid_stage.h"
#include "server/simulation/local_wind_table.h"
#include "server/simulation/mesh_stage.h"
#include "server/simulation/runge_kutta_stage.h"
#include "server/simulation/solve_stage.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Gives every node a free velocity and position, from the state at a substep's start to the other state
// buffers. Cloths without a later stage collide here, too. Computes the normals as well.
class ForceStage final : public Stage {
 public:
  // `solves` tells how many workgroups look for stretched springs. Throws std::runtime_error if the device
  // has too little memory.
  ForceStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
             const vulkan::Buffer& normals, const GridOptions& options, const SolveStage& solves);

  // Creates the kernels that cloths with these records need now instead of at their first use.
  void prepare(std::span<const shared::ClothRecord> cloths);
  // Divides the work of the same cloths again after their solvers changed. No tick may be in flight.
  void setTiles(std::span<const model::Cloth> cloths);

  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;
  // Records the normals of the state in the buffers `present`. The caller records a barrier before.
  void recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const;

  MeshSprings springs() const { return meshes_ ? meshes_->springs() : MeshSprings{}; }

 private:
  void recordTables(vulkan::Recorder& recorder) override;
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);

  const SolveStage& solves_;
  std::uint32_t workgroupSize_;
  float airDensity_;      // kg/m^3, of the newest tick
  LocalWindTable winds_;  // of the newest tick
  GridStage grids_;
  std::unique_ptr<MeshStage> meshes_;            // null if no cloth is a mesh
  std::unique_ptr<RungeKuttaStage> rungeKutta_;  // null for other integrators
};

}  // namespace clothstream::simulation
