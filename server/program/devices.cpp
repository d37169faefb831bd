// SPDX-License-Identifier: MIT
#include "server/program/devices.h"

#include "server/simulation/software_threads.h"

namespace clothstream::program {

vulkan::DeviceOptions deviceOptions(const ProgramOptions& options, std::uint32_t nodes) {
  return simulation::suitedTo(nodes, options.server.device);
}

}  // namespace clothstream::program
