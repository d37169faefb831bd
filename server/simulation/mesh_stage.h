// SPDX-License-Identifier: MIT
// Cloths that are meshes, on the device: forces, integration and collision over lists, and normals.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "server/simulation/advance_variant.h"
#include "server/simulation/device_table.h"
#include "server/simulation/mesh_tables.h"
#include "server/simulation/report_stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Accesses the nodes of meshes only, so that no barrier is needed between it
// and the stages of grids.
class MeshStage {
 public:
  // At least one cloth must be a mesh. Throws std::runtime_error if the device has too little memory for a
  // table.
  MeshStage(const vulkan::Device& device, const MeshTables& tables, const StateBuffers& state,
            const vulkan::Buffer& winds, const vulkan::Buffer& normals, model::Integrator integrator,
            std::uint32_t workgroupSize);

  // Replaces the tiles after solvers changed, for the same meshes. No work of this stage may be in flight.
  void setTiles(const MeshTiles& tiles);
  // Uploads the tables, before any other work of this stage.
  void recordTables(vulkan::Recorder& recorder) const;
  // Records one substep from state `from` to the other, for the meshes whose forces are followed by `follow`.
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);
  void recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const;
  MeshSprings springs() const { return {.nodes = &nodes_.texels(), .ends = &springEnds_.texels()}; }
  // Creates the kernel of this variant now instead of at its first use.
  void prepare(const AdvanceVariant& variant, Follow follow) {
    if (tileRanges_.of(follow).count > 0) advance(variant);
  }

 private:
  const StateBindings& advance(const AdvanceVariant& variant);

  const vulkan::Device& device_;
  StateBuffers state_;
  const vulkan::Buffer& winds_;  // LocalWindTable::texels()
  model::Integrator integrator_;
  std::uint32_t workgroupSize_;
  TileRanges tileRanges_;
  DeviceTable tiles_, nodes_, springEnds_, corners_;
  std::array<std::optional<StateBindings>, AdvanceVariant::kCount> advances_;  // made at their first use
  StateBindings normals_;
};

}  // namespace clothstream::simulation
