// SPDX-License-Identifier: MIT
// How fast the device moves bytes: the floor under everything that reads and writes a state.
#pragma once

#include <cstddef>

#include "server/vulkan/device.h"

namespace clothstream::bench {

// Least seconds the device takes to read and write so many texels of 16 bytes (32 bytes moved each), by the
// faster of a copy kernel and vkCmdCopyBuffer. Checks that they were copied.
double secondsToCopyTexels(vulkan::Device& device, std::size_t texels);

}  // namespace clothstream::bench
