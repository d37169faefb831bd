// SPDX-License-Identifier: MIT
// Kernels of grids, and the partition of their work.
#include "server/simulation/grid_stage.h"

#include "kernels/advance_mass_spring.h"
#include "kernels/compute_normals.h"

namespace clothstream::simulation {

// On software devices every load costs time, so that an invocation handles several rows. On GPUs every idle
// lane costs time (vulkan::KernelSettings).
GridStage::Cut GridStage::cutGrids(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                                   const GridOptions& options) {
  Cut cut{options.rowsPerInvocation, options.workgroupSize, {}};
  if (cut.rowsPerInvocation == 0) cut.rowsPerInvocation = device.hasGpuKernels() ? 1 : 4;
  cut.tiles = makeTiles(cloths, cut.rowsPerInvocation, cut.workgroupSize);
  while (cut.tiles.records.size() > device.limits().maxDispatchX) {
    cut.rowsPerInvocation *= 2;
    cut.tiles = makeTiles(cloths, cut.rowsPerInvocation, cut.workgroupSize);
  }
  return cut;
}

GridStage::GridStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                     const StateBuffers& state, const vulkan::Buffer& winds, const vulkan::Buffer& normals,
                     model::Integrator integrator, const GridOptions& options)
    : device_(device),
      state_(state),
      winds_(winds),
      integrator_(integrator),
      advanceCode_(options.advanceKernel == nullptr ? kernels::advance_mass_spring : *options.advanceKernel),
      cut_(cutGrids(device, cloths, options)),
      tiles_(device, cut_.tiles.records),
      normals_(
          bindStates(device, {device, kernels::compute_normals, cut_.workgroupSize, {cut_.rowsPerInvocation}},
                     [&](std::size_t from) {
                       return BufferList{&state.cloths, &tiles_.texels(), state.positions[from], &normals};
                     })) {}

const StateBindings& GridStage::advance(const AdvanceVariant& variant) {
  std::optional<StateBindings>& made = advances_[variant.index()];
  if (made) return *made;
  const StateBuffers& s = state_;
  made = bindStates(device_,
                    {device_, advanceCode_, cut_.workgroupSize,
                     variant.specialisation(cut_.rowsPerInvocation, integrator_)},
                    [&](std::size_t from) {
                      const std::size_t to = 1 - from;
                      return BufferList{&s.cloths,          &tiles_.texels(), s.positions[from],
                                        s.velocities[from], s.positions[to],  s.velocities[to],
                                        &s.colliders,       &s.nearColliders, &s.contactImpulses,
                                        &s.stretches,       &winds_};
                    });
  return *made;
}

void GridStage::setTiles(std::span<const model::Cloth> cloths) {
  cut_.tiles = makeTiles(cloths, cut_.rowsPerInvocation, cut_.workgroupSize);
  if (!cut_.tiles.records.empty()) tiles_.set(cut_.tiles.records);
}

void GridStage::recordTables(vulkan::Recorder& recorder) const {
  tiles_.recordUpload(recorder);
}

void GridStage::recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                              Follow follow, shared::AdvancePush push) {
  const TileRange tiles = cut_.tiles.ranges.of(follow);
  push.firstTile = tiles.first;
  if (tiles.count > 0)
    recorder.dispatch(advance(variant)[from], push, std::uint64_t{tiles.count} * cut_.workgroupSize,
                      std::uint64_t{cut_.rowsPerInvocation} * push.collision.nodeWork);
}

void GridStage::recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const {
  const std::uint64_t tiles = cut_.tiles.records.size();
  if (tiles > 0) recorder.dispatch(normals_[present], tiles * cut_.workgroupSize);
}

}  // namespace clothstream::simulation
