// SPDX-License-Identifier: MIT
// The state of a scene on the device, and its ways there and back.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. The state lies in one of two pairs of buffers by turns; `present` says in
// which. What is recorded needs a barrier before and after it.
class StateMemory {
 public:
  StateMemory(const vulkan::Device& device, std::uint32_t nodes);

  // RGBA32F texels: xyz, and of positions w = 1/kg, 0 for pinned nodes.
  std::array<vulkan::Buffer, 2> positions, velocities;
  vulkan::Buffer checkpointPositions, checkpointVelocities;

  // What recordUpload() brings: no such upload may be in flight.
  void write(const NodeState& state, std::span<const float> inverseMasses);
  // It also becomes the checkpoint.
  void recordUpload(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordCheckpoint(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordRollback(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordSave(vulkan::Recorder& recorder, std::uint32_t present);
  // What was saved last, once that is complete.
  NodeState collect() const;

 private:
  std::size_t bytes() const { return checkpointPositions.bytes(); }

  const vulkan::Device& device_;
  std::uint32_t nodes_;
  vulkan::Buffer upload_;    // positions, then velocities
  vulkan::Buffer readback_;  // the same; made when a state is first saved
};

}  // namespace clothstream::simulation
