// SPDX-License-Identifier: MIT
// Depths of nodes inside colliders, measured on the device.
#pragma once

#include <cstdint>
#include <span>

#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/collision/collision.h"

namespace clothstream::simulation {

// Belongs to the device's thread. The caller records a barrier before and after each recording.
class DepthMeter {
 public:
  // The first `nodeCount` records of `parts` (MotionBoundTables::parts) are the measured nodes. `parts` and
  // the state outlive the object. Throws std::runtime_error if the device has too little memory.
  DepthMeter(const vulkan::Device& device, std::uint32_t nodeCount, const vulkan::Buffer& parts,
             const StateBuffers& state, std::uint32_t workgroupSize);

  // Sets all depths to 0.
  void recordClear(vulkan::Recorder& recorder) const;
  // Measures the state buffers `present`. A node nearer to a collider than `touch`, in metres, touches it.
  void record(vulkan::Recorder& recorder, std::uint32_t present, float touch,
              const shared::CollisionPush& collision) const;
  // Copies the depths to the CPU.
  void recordReport(vulkan::Recorder& recorder, std::uint32_t slot) const;

  // For each collider, as the device numbers them: depth inside any collider of the deepest node that touches
  // it, in metres. 0: none is inside.
  std::span<const float> depths(std::uint32_t slot) const;

 private:
  std::uint32_t nodeCount_;
  vulkan::Buffer depths_, readback_;
  StateBindings measure_;
};

}  // namespace clothstream::simulation
