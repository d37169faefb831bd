// SPDX-License-Identifier: MIT
// Masses that change while a scene runs.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread; states hold the inverse mass of a node beside its position.
class MassStage {
 public:
  // The states that are given others: the two that take turns, and the checkpoint.
  static constexpr std::size_t kStates = 3;

  // Throws std::runtime_error where the device has no room. The buffers must outlive it.
  MassStage(const vulkan::Device& device, std::uint32_t nodes,
            const std::array<const vulkan::Buffer*, kStates>& positions);

  // Inverse masses, 1/kg, one a node; 0 of pinned ones. What recorded the last ones must be complete.
  void set(std::span<const float> inverseMasses);

  // Between a barrier and another.
  void record(vulkan::Recorder& recorder) const;

 private:
  std::uint32_t nodes_;
  vulkan::Buffer upload_;
  vulkan::Kernel kernel_;
  std::array<vulkan::Bindings, kStates> bindings_;
};

}  // namespace clothstream::simulation
