// SPDX-License-Identifier: MIT
// A kernel that works on either of the two state buffers.
#pragma once

#include <array>
#include <initializer_list>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"

namespace clothstream::simulation {

// Has bindings for each index of the state buffer that has the state.
struct Stage {
  using Buffers = std::initializer_list<const vulkan::Buffer*>;
  Stage(const vulkan::Device& device, const vulkan::KernelDescription& description, Buffers first,
        Buffers second)
      : kernel(device, description),
        from{vulkan::Bindings(device, kernel, first), vulkan::Bindings(device, kernel, second)} {}
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  vulkan::Kernel kernel;
  std::array<vulkan::Bindings, 2> from;  // they refer to the kernel
};

}  // namespace clothstream::simulation
