// SPDX-License-Identifier: MIT
// How many threads a software device is to have for a scene.
#pragma once

#include <cstdint>

#include "server/vulkan/device.h"

namespace clothstream::simulation {

// Cloth of at most so many nodes is simulated as fast or up to twice as fast by the thread that waits for it
// as by one for each processor: these are woken for each dispatch, of which a substep has several
// (docs/benchmarks.md).
inline constexpr std::uint32_t kFewNodes = 4096;

// The options, with the threads that suit a scene of so many nodes where neither they nor the environment
// (LP_NUM_THREADS) say how many.
vulkan::DeviceOptions suitedTo(std::uint32_t nodes, vulkan::DeviceOptions options);

}  // namespace clothstream::simulation
