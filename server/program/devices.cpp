// SPDX-License-Identifier: MIT
#include "server/program/devices.h"

#include <cstddef>

#include <fmt/format.h>

#include "server/simulation/software_threads.h"

namespace clothstream::program {

vulkan::DeviceOptions deviceOptions(const ProgramOptions& options, std::uint32_t nodes) {
  return simulation::suitedTo(nodes, options.server.device);
}

std::string describe(const vulkan::DeviceInfo& device) {
  constexpr const char* kKinds[] = {"discrete GPU", "integrated GPU", "virtual GPU", "software", "other"};
  return fmt::format("{} ({}, {}, Vulkan {})", device.name, kKinds[static_cast<std::size_t>(device.kind)],
                     device.driver, device.apiVersion);
}

}  // namespace clothstream::program
