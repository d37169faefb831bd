// SPDX-License-Identifier: MIT
// The state of a scene on the device, with upload and readback.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread. The state is in one of two alternating pairs of buffers; `present` is the
// index of the pair. The caller records a barrier before and after each recording.
class StateMemory {
 public:
  // `gasCloths`: number of cloths if one of them can hold gas, else 0.
  StateMemory(const vulkan::Device& device, std::uint32_t nodes, std::uint32_t gasCloths);

  // RGBA32F texels: xyz; w of positions is the inverse mass, 1/kg, 0 for pinned nodes.
  std::array<vulkan::Buffer, 2> positions, velocities;
  vulkan::Buffer checkpointPositions, checkpointVelocities;
  vulkan::Buffer gas, checkpointGas;  // RGBA32F texel for each cloth: GasState, pressure; empty without gas

  // Sets the state that recordUpload() uploads. No such upload may be in flight.
  void write(const NodeState& state, std::span<const float> inverseMasses);
  // Also sets the checkpoint.
  void recordUpload(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordCheckpoint(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordRollback(vulkan::Recorder& recorder, std::uint32_t present) const;
  void recordSave(vulkan::Recorder& recorder, std::uint32_t present);
  // The state that was saved last, once that recording is complete.
  NodeState collect() const;

 private:
  std::size_t bytes() const { return checkpointPositions.bytes(); }
  std::size_t gasBytes() const { return gas.bytes(); }
  std::size_t allBytes() const { return 2 * bytes() + gasBytes(); }

  const vulkan::Device& device_;
  std::uint32_t nodes_, gasCloths_;
  vulkan::Buffer upload_;    // positions, then velocities, then gas
  vulkan::Buffer readback_;  // the same; created when a state is first saved
};

}  // namespace clothstream::simulation
