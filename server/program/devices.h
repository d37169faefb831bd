// SPDX-License-Identifier: MIT
// The options of the Vulkan device of the program.
#pragma once

#include <cstdint>

#include "server/options/program_options.h"
#include "server/vulkan/device.h"

namespace clothstream::program {

// `nodes` is the size of the scene that the device will simulate.
vulkan::DeviceOptions deviceOptions(const ProgramOptions& options, std::uint32_t nodes);

}  // namespace clothstream::program
