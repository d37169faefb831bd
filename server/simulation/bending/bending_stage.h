// SPDX-License-Identifier: MIT
// Dihedral bending on the device: model/hinges.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/bending/bending_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Changes velocities at the start of a substep, for every solver.
class BendingStage final : public Stage {
 public:
  // Throws std::runtime_error if the device has too little memory.
  BendingStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
               std::uint32_t workgroupSize);

  static bool isIn(std::span<const model::Cloth> cloths);
  // True if the tables have the hinges of all cloths that bend now.
  bool serves(std::span<const model::Cloth> cloths) const;
  // True if the tables have the hinges of this cloth.
  bool bends(std::size_t cloth) const { return bends_[cloth]; }

  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  BendingStage(const vulkan::Device& device, const BendingTables& tables,
               std::span<const model::Cloth> cloths, const StateBuffers& state, std::uint32_t workgroupSize);

  void recordTables(vulkan::Recorder& recorder) override;

  std::vector<bool> bends_;  // cloths in the tables
  std::uint32_t hingeCount_, nodeCount_;
  DeviceTable hinges_, incidences_, lists_;
  vulkan::Buffer forces_;
  StateBindings measure_, bend_;
};

}  // namespace clothstream::simulation
