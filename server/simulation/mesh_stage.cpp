// SPDX-License-Identifier: MIT
// Kernels of meshes, and their tables.
#include "server/simulation/mesh_stage.h"

#include "kernels/advance_mesh.h"
#include "kernels/compute_mesh_normals.h"

namespace clothstream::simulation {

using vulkan::BindingKind;
using vulkan::Bindings;
using vulkan::Kernel;

namespace {

// Work of a node of a mesh (vulkan::Recorder::dispatch).
constexpr std::uint64_t kMeshWork = 2;

}  // namespace

MeshStage::MeshStage(const vulkan::Device& device, const MeshTables& tables, const StateBuffers& state,
                     const vulkan::Buffer& normals, model::Integrator integrator, std::uint32_t workgroupSize)
    : device_(device),
      state_(state),
      integrator_(integrator),
      workgroupSize_(workgroupSize),
      tileRanges_(tables.tiles.ranges),
      tiles_(device, tables.tiles.records),
      nodes_(device, tables.nodes),
      springEnds_(device, tables.springEnds),
      corners_(device, tables.corners),
      normals_(device, {.name = "compute_mesh_normals",
                        .spirv = kernels::compute_mesh_normals,
                        .bindings = {BindingKind::texels, BindingKind::texels, BindingKind::texels,
                                     BindingKind::storage, BindingKind::texels, BindingKind::texels},
                        .workgroupSize = workgroupSize}),
      normalsOf_{Bindings(device, normals_,
                          {&state.cloths, &tiles_.texels(), state.positions[0], &normals, &nodes_.texels(),
                           &corners_.texels()}),
                 Bindings(device, normals_,
                          {&state.cloths, &tiles_.texels(), state.positions[1], &normals, &nodes_.texels(),
                           &corners_.texels()})} {}

vulkan::Bindings MeshStage::advanceFrom(const Kernel& kernel, std::size_t from) const {
  const std::size_t to = 1 - from;
  return Bindings(device_, kernel,
                  {&state_.cloths, &tiles_.texels(), state_.positions[from], state_.velocities[from],
                   state_.positions[to], state_.velocities[to], &state_.colliders, &state_.nearColliders,
                   &state_.contactImpulses, &nodes_.texels(), &corners_.texels(), &springEnds_.texels()});
}

MeshStage::Advance::Advance(const MeshStage& stage, const AdvanceVariant& variant)
    : kernel(stage.device_, {.name = "advance_mesh",
                             .spirv = kernels::advance_mesh,
                             .bindings = {BindingKind::texels, BindingKind::texels, BindingKind::texels,
                                          BindingKind::texels, BindingKind::storage, BindingKind::storage,
                                          BindingKind::texels, BindingKind::texels, BindingKind::storage,
                                          BindingKind::texels, BindingKind::texels, BindingKind::texels},
                             .pushConstantBytes = sizeof(shared::AdvancePush),
                             .workgroupSize = stage.workgroupSize_,
                             .specialisation = variant.specialisation(1, stage.integrator_)}),
      from{stage.advanceFrom(kernel, 0), stage.advanceFrom(kernel, 1)} {}

const MeshStage::Advance& MeshStage::advance(const AdvanceVariant& variant) {
  std::unique_ptr<Advance>& made = advances_[variant.index()];
  if (!made) made = std::make_unique<Advance>(*this, variant);
  return *made;
}

void MeshStage::setTiles(const MeshTiles& tiles) {
  tiles_.set(tiles.records);
  tileRanges_ = tiles.ranges;
}

void MeshStage::recordTables(vulkan::Recorder& recorder) const {
  for (const DeviceTable* table : {&tiles_, &nodes_, &springEnds_, &corners_}) table->recordUpload(recorder);
}

void MeshStage::recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                              Follow follow, shared::AdvancePush push) {
  const TileRange tiles = tileRanges_.of(follow);
  push.firstTile = tiles.first;
  if (tiles.count > 0)
    recorder.dispatch(advance(variant).from[from], push, std::uint64_t{tiles.count} * workgroupSize_,
                      kMeshWork * push.collision.nodeWork);
}

void MeshStage::recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const {
  recorder.dispatch(normalsOf_[present], std::uint64_t{tileRanges_.count()} * workgroupSize_);
}

}  // namespace clothstream::simulation
