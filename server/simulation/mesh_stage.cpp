// SPDX-License-Identifier: MIT
// Kernels of meshes, and their tables.
#include "server/simulation/mesh_stage.h"

#include "kernels/advance_mesh.h"
#include "kernels/compute_mesh_normals.h"

namespace clothstream::simulation {

namespace {

// Work of a node of a mesh (vulkan::Recorder::dispatch).
constexpr std::uint64_t kMeshWork = 2;

}  // namespace

MeshStage::MeshStage(const vulkan::Device& device, const MeshTables& tables, const StateBuffers& state,
                     const vulkan::Buffer& winds, const vulkan::Buffer& normals, model::Integrator integrator,
                     std::uint32_t workgroupSize)
    : device_(device),
      state_(state),
      winds_(winds),
      integrator_(integrator),
      workgroupSize_(workgroupSize),
      tileRanges_(tables.tiles.ranges),
      tiles_(device, tables.tiles.records),
      nodes_(device, tables.nodes),
      springEnds_(device, tables.springEnds),
      corners_(device, tables.corners),
      normals_(
          bindStates(device, {device, kernels::compute_mesh_normals, workgroupSize}, [&](std::size_t from) {
            return BufferList{&state.cloths, &tiles_.texels(), state.positions[from],
                              &normals,      &nodes_.texels(), &corners_.texels()};
          })) {}

const StateBindings& MeshStage::advance(const AdvanceVariant& variant) {
  std::optional<StateBindings>& made = advances_[variant.index()];
  if (made) return *made;
  const StateBuffers& s = state_;
  made = bindStates(device_,
                    {device_, kernels::advance_mesh, workgroupSize_, variant.specialisation(1, integrator_)},
                    [&](std::size_t from) {
                      const std::size_t to = 1 - from;
                      return BufferList{&s.cloths,
                                        &tiles_.texels(),
                                        s.positions[from],
                                        s.velocities[from],
                                        s.positions[to],
                                        s.velocities[to],
                                        &s.colliders,
                                        &s.nearColliders,
                                        &s.contactImpulses,
                                        &nodes_.texels(),
                                        &corners_.texels(),
                                        &springEnds_.texels(),
                                        &winds_};
                    });
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
    recorder.dispatch(advance(variant)[from], push, std::uint64_t{tiles.count} * workgroupSize_,
                      kMeshWork * push.collision.nodeWork);
}

void MeshStage::recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const {
  recorder.dispatch(normals_[present], std::uint64_t{tileRanges_.count()} * workgroupSize_);
}

}  // namespace clothstream::simulation
