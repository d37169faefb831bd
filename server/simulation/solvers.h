// SPDX-License-Identifier: MIT
// The stages that follow from the solvers and the bending of the cloths, which may change while a scene runs.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/cloth_report.h"
#include "server/simulation/kept_stages.h"
#include "server/simulation/stage_plan.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// SimulationOptions, and the workgroup that follows from them.
struct SolverSizes {
  std::uint32_t workgroup = 64;  // at most the limit of the device
  std::uint32_t askedWorkgroup = 0;
  std::optional<std::uint32_t> xpbdWholeNodes = {}, solveWholeNodes = {};
};

// Belongs to the device's thread, except for make().
class Solvers {
 public:
  // Throws std::runtime_error if the device has too little memory.
  Solvers(const vulkan::Device& device, const StateBuffers& state, std::span<const model::Cloth> cloths,
          const SolverSizes& sizes);

  // See ClothSimulation::makesStages(), planStages(), makeStages(), takeStages() and stagesMade().
  bool needs(std::span<const model::Cloth> cloths) const;
  StagePlan plan(std::span<const model::Cloth> cloths) const;
  std::shared_ptr<NewStages> make(const StagePlan& plan);
  void take(std::shared_ptr<NewStages> stages) { taken_ = std::move(stages); }
  std::uint64_t made() const { return made_; }

  // Makes the stages that these cloths need, and lets the former ones go. Returns true if the solvers need
  // other tables than before. No tick may be in flight. Throws std::runtime_error and changes nothing if the
  // device has too little memory.
  bool set(std::span<const model::Cloth> cloths);
  // Creates the kernels that cloths with these records need now instead of at their first use.
  void prepare(std::span<const shared::ClothRecord> cloths);

  const SolveStage& solves() const { return solves_; }
  // Acts before the forces. Null: no cloth bends.
  Stage* bending() { return bends_ ? bending_.get() : nullptr; }
  // Act after the forces, in this order.
  std::vector<SolverStage*> afterForces();

  // Adds what the solves of a complete tick found to the reports of the cloths.
  void addTo(std::span<ClothReport> reports) const;
  // Records of these solves: those of the constraints and of implicit Euler, then of assembled systems.
  std::vector<shared::SolveRecord> records() const;

  // Marks the springs that ACAD held in the last recorded substep; returns false if there are no systems.
  bool recordActiveSprings(vulkan::Recorder& recorder);

 private:
  bool needsSolvers(std::span<const model::Solver> wanted) const;
  bool needsBending(std::span<const model::Cloth> cloths) const;
  // Cloths of the stage that these cloths need to bend. Empty if the present one serves them, or if none
  // bends.
  std::vector<model::Cloth> bendingCloths(std::span<const model::Cloth> cloths) const;
  // Null without cloths.
  std::unique_ptr<BendingStage> makeBending(std::span<const model::Cloth> cloths) const;
  SolverStages makeSolvers(std::span<const model::Cloth> cloths);
  // Makes these stages current, and returns the former ones.
  SolverStages exchange(SolverStages next);

  const vulkan::Device& device_;
  const StateBuffers state_;
  const SolverSizes sizes_;
  SolveStage solves_;
  SolverStages present_;                   // `solves_` uses its systems
  std::unique_ptr<BendingStage> bending_;  // created when a cloth first bends
  bool bends_ = false;                     // a cloth bends now
  KeptStages kept_;                        // stages of earlier solvers
  std::shared_ptr<NewStages> taken_;       // by take(); may be null
  std::mutex making_;                      // of makeSolvers(): guards the kernels of `solves_`
  std::uint64_t made_ = 0;
};

}  // namespace clothstream::simulation
