// SPDX-License-Identifier: MIT
// Number of threads of a software device for a scene.
#include "server/simulation/software_threads.h"

#include <cstdlib>

namespace clothstream::simulation {

vulkan::DeviceOptions suitedTo(std::uint32_t nodes, vulkan::DeviceOptions options) {
  if (!options.softwareThreads && std::getenv("LP_NUM_THREADS") == nullptr && nodes <= kFewNodes)
    options.softwareThreads = 0;
  return options;
}

}  // namespace clothstream::simulation
