// SPDX-License-Identifier: MIT
// Speed at which the device moves bytes: a lower bound for everything that reads and writes a state.
#pragma once

#include <cstddef>

#include "server/vulkan/device.h"

namespace clothstream::bench {

// Minimum seconds that the device takes to read and write this many texels of 16 bytes (32 bytes moved each),
// with the faster of a copy kernel and vkCmdCopyBuffer. Checks the copied bytes.
double secondsToCopyTexels(vulkan::Device& device, std::size_t texels);

}  // namespace clothstream::bench
