// SPDX-License-Identifier: MIT
// How many threads a software device is to have for a scene.
#include "server/simulation/software_threads.h"

#include <cstdlib>

namespace clothstream::simulation {

vulkan::DeviceOptions suitedTo(std::uint32_t nodes, vulkan::DeviceOptions options) {
  if (!options.softwareThreads && std::getenv("LP_NUM_THREADS") == nullptr && nodes <= kFewNodes)
    options.softwareThreads = 0;
  return options;
}

}  // namespace clothstream::simulation
