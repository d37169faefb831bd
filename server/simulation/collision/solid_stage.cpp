// SPDX-License-Identifier: MIT
#include "server/simulation/collision/solid_stage.h"

#include <algorithm>

#include "kernels/collide_solids.h"
#include "kernels/sample_distances.h"
#include "server/model/distance_grid.h"
#include "server/model/price.h"

namespace clothstream::simulation {

namespace {

// Work of a sample, in searches near the surface: a search from far away visits many triangles.
constexpr double kSampleWork = 8;
// Work of a visit, in moves of a node by its springs.
constexpr std::uint64_t kVisitWork = 1;
// The most work of a contact, or of a sample.
constexpr std::uint64_t kMostWork = kVisitWork * shared::kMostSolidVisits;

}  // namespace

SolidStage::SolidStage(const vulkan::Device& device, const SolidTables& tables,
                       std::span<const model::Cloth> cloths, const StateBuffers& state,
                       std::uint32_t workgroupSize)
    : workgroupSize_(workgroupSize),
      tileCount_(static_cast<std::uint32_t>(nodeTiles(cloths, workgroupSize).size())),
      solids_(device, tables.texels),
      tiles_(device, nodeTiles(cloths, workgroupSize)),
      collide_(bindStates(device, {device, kernels::collide_solids, workgroupSize, tables.specialisation()},
                          [&](std::size_t from) {
                            const std::size_t to = 1 - from;
                            return BufferList{&state.cloths,          &tiles_.texels(),
                                              &solids_.texels(),      state.positions[from],
                                              state.positions[to],    state.velocities[to],
                                              &state.contactImpulses, &state.colliders};
                          })) {
  for (std::size_t i = 0; i < tables.solids.size(); ++i) {
    const model::ClosedMesh& mesh = *tables.solids[i];
    workOfSolid_ = std::max(workOfSolid_, static_cast<std::uint64_t>(model::colliderWork(tables.solids[i])));
    if (mesh.distanceCell == 0) {
      mostOfSolid_ = kMostWork;
      continue;
    }
    sampled_.push_back(
        {{.solid = tables.places[i], .reserved0 = 0, .reserved1 = 0, .reserved2 = 0},
         model::distanceGridOf(mesh, mesh.distanceCell).points(),
         std::min(static_cast<std::uint64_t>(kSampleWork * model::searchWork(mesh)), kMostWork)});
  }
  if (sampled_.empty()) return;
  sample_.emplace(device, vulkan::Kernel(device, kernels::sample_distances, workgroupSize),
                  BufferList{&solids_.texels(), &solids_.texels()});
}

void SolidStage::recordTables(vulkan::Recorder& recorder) {
  solids_.recordUpload(recorder);
  tiles_.recordUpload(recorder);
  for (const Sampled& sampled : sampled_) {
    recorder.barrier();
    recorder.dispatch(*sample_, sampled.push, sampled.points, sampled.work, kMostWork);
  }
}

void SolidStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const std::uint32_t solids = substep.solids;
  if (solids == 0) return;
  recorder.barrier();
  recorder.dispatch(collide_[substep.from],
                    shared::SolidPush{.collision = substep.collision,
                                      .solidCount = solids,
                                      .reserved0 = 0,
                                      .reserved1 = 0,
                                      .reserved2 = 0},
                    std::uint64_t{tileCount_} * workgroupSize_, 1 + solids * workOfSolid_,
                    solids * mostOfSolid_);
}

}  // namespace clothstream::simulation
