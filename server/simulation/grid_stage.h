// SPDX-License-Identifier: MIT
// Cloths that are grids, on the device: forces, integration and collision over tiles of nodes, and normals.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/simulation/advance_variant.h"
#include "server/simulation/device_table.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// As in SimulationOptions.
struct GridOptions {
  std::uint32_t rowsPerInvocation = 0;
  std::uint32_t workgroupSize = 64;  // at most what the device can have
  std::span<const std::uint32_t> advanceKernel = {};
};

// Belongs to the device's thread. It touches the nodes of grids alone; there need not be any.
class GridStage {
 public:
  // Throws std::runtime_error where the device has no room for its table.
  GridStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
            const vulkan::Buffer& normals, model::Integrator integrator, const GridOptions& options);

  // Of the same grids, other solvers' order of them; nothing of this stage may be in flight.
  void setTiles(std::span<const model::Cloth> cloths);
  // Its table, before anything else that is with it.
  void recordTables(vulkan::Recorder& recorder) const;
  // One substep from state `from` to the other, of the grids whose forces are followed by this.
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);
  void recordNormals(vulkan::Recorder& recorder, std::uint32_t present) const;
  // Makes the kernel of this variant now rather than when it is first needed.
  void prepare(const AdvanceVariant& variant, Follow follow) {
    if (cut_.tiles.ranges.of(follow).count > 0) advance(variant);
  }

 private:
  // How the work is cut; the results do not depend on it.
  struct Cut {
    std::uint32_t rowsPerInvocation, workgroupSize;
    Tiles tiles;
  };
  static Cut cutGrids(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                      const GridOptions& options);
  const Stage& advance(const AdvanceVariant& variant);

  const vulkan::Device& device_;
  StateBuffers state_;
  model::Integrator integrator_;
  std::span<const std::uint32_t> advanceSpirv_;
  Cut cut_;
  DeviceTable tiles_;
  std::array<std::unique_ptr<Stage>, AdvanceVariant::kCount> advances_;  // made when they are first needed
  Stage normals_;
};

}  // namespace clothstream::simulation
