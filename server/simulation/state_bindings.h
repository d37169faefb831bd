// SPDX-License-Identifier: MIT
// Bindings of a kernel that works on either of the two state buffers.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"

namespace clothstream::simulation {

// For each index of the state buffer that has the state.
using StateBindings = std::array<vulkan::Bindings, 2>;

using BufferList = std::vector<const vulkan::Buffer*>;

// `buffersOf` gives the kernel's buffers by the index of the state buffer that has the state.
inline StateBindings bindStates(const vulkan::Device& device, const vulkan::Kernel& kernel,
                                const std::function<BufferList(std::size_t from)>& buffersOf) {
  return {vulkan::Bindings(device, kernel, buffersOf(0)), vulkan::Bindings(device, kernel, buffersOf(1))};
}

}  // namespace clothstream::simulation
