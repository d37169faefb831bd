// SPDX-License-Identifier: MIT
// Cloths that are grids, on the device: forces, integration and collision over tiles of nodes, and normals.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "server/simulation/advance_variant.h"
#include "server/simulation/device_table.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// See SimulationOptions.
struct GridOptions {
  std::uint32_t rowsPerInvocation = 0;
  std::uint32_t workgroupSize = 64;  // at most the limit of the device
  const vulkan::KernelCode* advanceKernel = nullptr;
};

// Belongs to the device's thread. Accesses the nodes of grids only; there may be none.
class GridStage {
 public:
  // Throws std::runtime_error if the device has too little memory for the table.
  GridStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
            const vulkan::Buffer& winds, const vulkan::Buffer& normals, model::Integrator integrator,
            const GridOptions& options);

  // Replaces the tiles after solvers changed, for the same grids. No work of this stage may be in flight.
  void setTiles(std::span<const model::Cloth> cloths);
  // Uploads the table, before any other work of this stage.
  void recordTables(vulkan::Recorder& recorder) const;
  // Records one substep from state `from` to the other, for the grids whose forces are followed by `follow`.
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);
  void recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const;
  // Creates the kernel of this variant now instead of at its first use.
  void prepare(const AdvanceVariant& variant, Follow follow) {
    if (cut_.tiles.ranges.of(follow).count > 0) advance(variant);
  }

 private:
  // Partition of the work. The results do not depend on it.
  struct Cut {
    std::uint32_t rowsPerInvocation, workgroupSize;
    Tiles tiles;
  };
  static Cut cutGrids(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                      const GridOptions& options);
  const StateBindings& advance(const AdvanceVariant& variant);

  const vulkan::Device& device_;
  StateBuffers state_;
  const vulkan::Buffer& winds_;  // LocalWindTable::texels()
  model::Integrator integrator_;
  const vulkan::KernelCode& advanceCode_;
  Cut cut_;
  DeviceTable tiles_;
  std::array<std::optional<StateBindings>, AdvanceVariant::kCount> advances_;  // made at their first use
  StateBindings normals_;
};

}  // namespace clothstream::simulation
