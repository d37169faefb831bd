// SPDX-License-Identifier: MIT
// The Vulkan device of the program: its options, and its name for people.
#pragma once

#include <cstdint>
#include <string>

#include "server/options/program_options.h"
#include "server/vulkan/device.h"

namespace clothstream::program {

// `nodes` is the size of the scene that the device will simulate.
vulkan::DeviceOptions deviceOptions(const ProgramOptions& options, std::uint32_t nodes);

// Name, kind, driver and version.
std::string describe(const vulkan::DeviceInfo& device);

}  // namespace clothstream::program
