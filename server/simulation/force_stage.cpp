// SPDX-License-Identifier: MIT
// Forces of all cloths, and their integration over a substep.
#include "server/simulation/force_stage.h"

#include <algorithm>
#include <functional>

#include "server/simulation/scene_tables.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

bool isDamped(const shared::ClothRecord& cloth) {
  return cloth.structuralDamping != 0 || cloth.shearDamping != 0 || cloth.bendDamping != 0;
}

bool isBlown(const shared::ClothRecord& cloth) {
  return cloth.drag != 0 || cloth.lift != 0;
}

// Cloths collide in the advance kernel if no other stage follows, and in that stage otherwise.
AdvanceVariant variantOf(std::span<const shared::ClothRecord> cloths, float airDensity, bool localWinds,
                         bool colliders, Follow follow) {
  const bool springs = follow != Follow::corrections;
  const bool air = airDensity != 0 && std::any_of(cloths.begin(), cloths.end(), isBlown);
  return {springs && std::any_of(cloths.begin(), cloths.end(), isDamped),
          air,
          colliders && follow == Follow::nothing,
          springs,
          air && localWinds,
          follow == Follow::limit || follow == Follow::paper,
          follow == Follow::paper};
}

}  // namespace

ForceStage::ForceStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                       const vulkan::Buffer& normals, const GridOptions& options, const SolveStage& solves)
    : solves_(solves),
      workgroupSize_(options.workgroupSize),
      airDensity_(scene.environment.airDensity),
      winds_(device, scene.winds.size()),
      grids_(device, scene.cloths, state, winds_.texels(), normals, scene.integrator, options) {
  const MeshTables tables = meshTables(scene.cloths, workgroupSize_);
  if (!tables.nodes.empty())
    meshes_ = std::make_unique<MeshStage>(device, tables, state, winds_.texels(), normals, scene.integrator,
                                          workgroupSize_);
  if (scene.integrator == model::Integrator::rungeKutta4)
    rungeKutta_ = std::make_unique<RungeKuttaStage>(device, state, clothOffsets(scene.cloths));
}

void ForceStage::prepare(std::span<const shared::ClothRecord> cloths) {
  for (const bool colliders : {false, true})
    for (const Follow follow : kFollows) {
      const AdvanceVariant variant = variantOf(cloths, airDensity_, winds_.count() > 0, colliders, follow);
      grids_.prepare(variant, follow);
      if (meshes_) meshes_->prepare(variant, follow);
    }
}

void ForceStage::setTiles(std::span<const model::Cloth> cloths) {
  grids_.setTiles(cloths);
  if (meshes_) meshes_->setTiles(meshTiles(cloths, workgroupSize_));
  outdate();
}

void ForceStage::recordTables(vulkan::Recorder& recorder) {
  grids_.recordTables(recorder);
  if (meshes_) meshes_->recordTables(recorder);
}

void ForceStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  airDensity_ = tick.inputs.environment.airDensity;
  winds_.recordUpload(recorder, tick.inputs.winds, tick.slot);
}

void ForceStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const Tick& tick = substep.tick;
  const model::Environment& environment = tick.inputs.environment;
  shared::AdvancePush push{.gravity = vectorOf(environment.gravity),
                           .stepSeconds = static_cast<float>(tick.substepSeconds),
                           .wind = vectorOf(environment.wind),
                           .airFactor = environment.airDensity / 6,
                           .collision = substep.collision,
                           .firstTile = 0,
                           .stretchSize = 0,
                           .stretchGroups = 0,
                           .firstMark = kFirstMark,
                           .localWinds = winds_.count()};
  recorder.barrier();
  if (!rungeKutta_) {
    const bool collides = substep.collision.colliderCount > 0;
    for (const Follow follow : kFollows)
      recordAdvance(recorder, substep.from,
                    variantOf(tick.cloths, airDensity_, winds_.count() > 0, collides, follow), follow, push);
    return;
  }
  const AdvanceVariant variant =
      variantOf(tick.cloths, airDensity_, winds_.count() > 0, false, Follow::nothing);
  const auto recordEuler = [&](std::uint32_t from, float part) {
    push.stepSeconds = part * static_cast<float>(tick.substepSeconds);
    recordAdvance(recorder, from, variant, Follow::nothing, push);
  };
  // By reference, because a copy in the std::function would be allocated.
  rungeKutta_->record(recorder, substep.from, push.collision, std::ref(recordEuler));
}

void ForceStage::recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                               Follow follow, shared::AdvancePush push) {
  push.stretchSize = firstStretchSize(follow);
  push.stretchGroups = solves_.stretchGroups(follow);
  grids_.recordAdvance(recorder, from, variant, follow, push);
  if (meshes_) meshes_->recordAdvance(recorder, from, variant, follow, push);
}

void ForceStage::recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const {
  grids_.recordNormals(recorder, present);
  if (meshes_) meshes_->recordNormals(recorder, present);
}

}  // namespace clothstream::simulation
