// SPDX-License-Identifier: MIT
// Number of threads of a software device for a scene.
#pragma once

#include <cstdint>

#include "server/vulkan/device.h"

namespace clothstream::simulation {

// Largest number of nodes for which a software device should have no threads. The waiting thread then
// simulates as fast as one thread per processor, or up to twice as fast: those threads are woken for each
// dispatch, and a substep has several dispatches (docs/benchmarks.md).
inline constexpr std::uint32_t kFewNodes = 4096;

// Returns the options with the number of threads that suits a scene of `nodes` nodes, unless the options or
// the environment (LP_NUM_THREADS) give a number.
vulkan::DeviceOptions suitedTo(std::uint32_t nodes, vulkan::DeviceOptions options);

}  // namespace clothstream::simulation
