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

// Belongs to the device's thread. States have the inverse mass of a node in the w of its position.
class MassStage {
 public:
  // States to change: the two alternating ones and the checkpoint.
  static constexpr std::size_t kStates = 3;

  // Throws std::runtime_error if the device has too little memory. The buffers must outlive it.
  MassStage(const vulkan::Device& device, std::uint32_t nodes,
            const std::array<const vulkan::Buffer*, kStates>& positions);

  // Sets the inverse masses, 1/kg, by node; 0 for pinned nodes. The last recording must be complete.
  void set(std::span<const float> inverseMasses);

  // The caller records a barrier before and after.
  void record(vulkan::Recorder& recorder) const;

 private:
  std::uint32_t nodes_;
  vulkan::Buffer upload_;
  vulkan::Kernel kernel_;
  std::array<vulkan::Bindings, kStates> bindings_;
};

}  // namespace clothstream::simulation
