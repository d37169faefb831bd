// SPDX-License-Identifier: MIT
// Where joints take the nodes of cloths, once in each tick.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/simulation/cloth_skin/cloth_skin_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

class ClothSkinStage final : public Stage {
 public:
  // Throws std::runtime_error if the device has too little memory.
  ClothSkinStage(const vulkan::Device& device, ClothSkinTables tables, const StateBuffers& state,
                 std::uint32_t workgroupSize);

  // Uploads the joints. Those of a collider that the tick does not have rest where it starts. Allocates
  // nothing.
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  // Takes cloths along where joints jump, gives nodes that follow exactly their velocities, and computes the
  // limits of the others. Stage "attachments".
  void recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) override;

  // LimitRecords of the tick.
  const vulkan::Buffer& limits() const { return limits_; }
  std::uint32_t limitCount() const { return tables_.limitCount; }
  bool hasBackstops() const { return tables_.hasBackstops; }

 private:
  void recordTables(vulkan::Recorder& recorder) override;
  void recordJumps(vulkan::Recorder& recorder, std::uint32_t present) const;

  ClothSkinTables tables_;
  DeviceTable nodes_;
  vulkan::Buffer transformTexels_, limits_;
  std::array<vulkan::Buffer, 2> uploads_;  // by Tick::slot: a tick may be in flight
  std::vector<std::uint8_t> jumps_;        // of each cloth: its joints jump in this tick
  std::vector<model::Transform> transforms_;
  StateBindings carry_, place_;
};

}  // namespace clothstream::simulation
