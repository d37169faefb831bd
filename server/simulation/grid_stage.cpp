// SPDX-License-Identifier: MIT
// Kernels of grids, and the partition of their work.
#include "server/simulation/grid_stage.h"

#include <initializer_list>

#include "kernels/advance_mass_spring.h"
#include "kernels/compute_normals.h"

namespace clothstream::simulation {

using vulkan::BindingKind;

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
                     const StateBuffers& state, const vulkan::Buffer& normals, model::Integrator integrator,
                     const GridOptions& options)
    : device_(device),
      state_(state),
      integrator_(integrator),
      advanceSpirv_(options.advanceKernel.empty()
                        ? std::span<const std::uint32_t>(kernels::advance_mass_spring)
                        : options.advanceKernel),
      cut_(cutGrids(device, cloths, options)),
      tiles_(device, cut_.tiles.records),
      normals_(
          device,
          {.name = "compute_normals",
           .spirv = kernels::compute_normals,
           .bindings = {BindingKind::texels, BindingKind::texels, BindingKind::texels, BindingKind::storage},
           .workgroupSize = cut_.workgroupSize,
           .specialisation = {cut_.rowsPerInvocation}},
          {&state.cloths, &tiles_.texels(), state.positions[0], &normals},
          {&state.cloths, &tiles_.texels(), state.positions[1], &normals}) {}

const Stage& GridStage::advance(const AdvanceVariant& variant) {
  std::unique_ptr<Stage>& made = advances_[variant.index()];
  if (made) return *made;
  const StateBuffers& s = state_;
  made = std::make_unique<Stage>(
      device_,
      vulkan::KernelDescription{
          .name = "advance_mass_spring",
          .spirv = advanceSpirv_,
          .bindings = {BindingKind::texels, BindingKind::texels, BindingKind::texels, BindingKind::texels,
                       BindingKind::storage, BindingKind::storage, BindingKind::texels, BindingKind::texels,
                       BindingKind::storage, BindingKind::storage},
          .pushConstantBytes = sizeof(shared::AdvancePush),
          .workgroupSize = cut_.workgroupSize,
          .specialisation = variant.specialisation(cut_.rowsPerInvocation, integrator_)},
      Stage::Buffers{&s.cloths, &tiles_.texels(), s.positions[0], s.velocities[0], s.positions[1],
                     s.velocities[1], &s.colliders, &s.nearColliders, &s.contactImpulses, &s.stretches},
      Stage::Buffers{&s.cloths, &tiles_.texels(), s.positions[1], s.velocities[1], s.positions[0],
                     s.velocities[0], &s.colliders, &s.nearColliders, &s.contactImpulses, &s.stretches});
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
    recorder.dispatch(advance(variant).from[from], push, std::uint64_t{tiles.count} * cut_.workgroupSize,
                      std::uint64_t{cut_.rowsPerInvocation} * push.collision.nodeWork);
}

void GridStage::recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const {
  const std::uint64_t tiles = cut_.tiles.records.size();
  if (tiles > 0) recorder.dispatch(normals_.from[present], tiles * cut_.workgroupSize);
}

}  // namespace clothstream::simulation
