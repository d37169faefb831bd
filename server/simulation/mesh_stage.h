// SPDX-License-Identifier: MIT
// Cloths that are meshes, on the device: forces, integration and collision over lists, and normals.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/simulation/advance_variant.h"
#include "server/simulation/device_table.h"
#include "server/simulation/mesh_tables.h"
#include "server/simulation/report_stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. It touches the nodes of meshes alone, so that it may run beside the stages
// of grids without a barrier between.
class MeshStage {
 public:
  // There must be a mesh. Throws std::runtime_error where the device has no room for a table.
  MeshStage(const vulkan::Device& device, const MeshTables& tables, const StateBuffers& state,
            const vulkan::Buffer& normals, model::Integrator integrator, std::uint32_t workgroupSize);

  // Of the same meshes, other solvers' order of them; nothing of this stage may be in flight.
  void setTiles(const Tiles& tiles);
  // Its tables, before anything else that is with them.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep from state `from` to the other, of the meshes whose forces are followed by this.
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);
  void recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const;
  MeshSprings springs() const { return {.nodes = &nodes_.texels(), .ends = &springEnds_.texels()}; }
  // Makes the kernel of this variant now rather than when it is first needed.
  void prepare(const AdvanceVariant& variant, Follow follow) {
    if (tileRanges_.of(follow).count > 0) advance(variant);
  }

 private:
  struct Advance {
    Advance(const MeshStage& stage, const AdvanceVariant& variant);
    Advance(const Advance&) = delete;
    Advance& operator=(const Advance&) = delete;

    vulkan::Kernel kernel;
    std::array<vulkan::Bindings, 2> from;  // they point to the kernel
  };

  const Advance& advance(const AdvanceVariant& variant);
  vulkan::Bindings advanceFrom(const vulkan::Kernel& kernel, std::size_t from) const;

  const vulkan::Device& device_;
  StateBuffers state_;
  model::Integrator integrator_;
  std::uint32_t workgroupSize_;
  TileRanges tileRanges_;
  DeviceTable tiles_, nodes_, springEnds_, corners_;
  std::array<std::unique_ptr<Advance>, AdvanceVariant::kCount> advances_;
  vulkan::Kernel normals_;
  std::array<vulkan::Bindings, 2> normalsOf_;
};

}  // namespace clothstream::simulation
