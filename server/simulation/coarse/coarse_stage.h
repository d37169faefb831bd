// SPDX-License-Identifier: MIT
// Coarse correction on the device: model/coarse_level.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/coarse/coarse_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Changes positions and velocities at the start of a substep, for every
// solver.
class CoarseStage final : public Stage {
 public:
  // Throws std::runtime_error if the device has too little memory.
  CoarseStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateBuffers& state,
              std::uint32_t workgroupSize);

  static bool isIn(std::span<const model::Cloth> cloths);

  // Corrects the start of a substep.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  struct Moves {
    StateBindings mesh, grid;
  };

  CoarseStage(const vulkan::Device& device, const CoarseTables& tables, const StateBuffers& state,
              std::uint32_t workgroupSize);

  Moves bindMoves(const vulkan::Device& device, const StateBuffers& state, std::uint32_t workgroupSize,
                  bool colliders) const;
  void recordTables(vulkan::Recorder& recorder) override;
  void recordLevel(vulkan::Recorder& recorder, std::uint32_t present, const shared::CoarsePush& push) const;

  std::vector<CoarseTables::Level> levels_;
  std::uint32_t rows_;  // of a column, that an invocation moves
  DeviceTable nodes_, means_, shares_, colours_, links_;
  vulkan::Buffer parts_, corrections_;
  StateBindings averageNodes_, averageRows_, hold_;
  std::array<Moves, 2> moves_;  // without and with colliders
};

}  // namespace clothstream::simulation
