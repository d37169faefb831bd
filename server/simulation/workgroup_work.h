// SPDX-License-Identifier: MIT
// Work of a workgroup that computes a whole cloth.
#pragma once

#include <cstdint>

#include "server/vulkan/device.h"

namespace clothstream::simulation {

// Nodes times iterations that one workgroup computes in about 10 ms. Longer solves take several dispatches.
inline std::uint32_t nodesPerDispatch(const vulkan::Device& device) {
  return device.isSoftware() ? 1u << 18 : 1u << 20;
}

// Work of an invocation (vulkan::Recorder::dispatch) if this many share the work. At least 1.
inline std::uint64_t workPerInvocation(std::uint64_t work, std::uint32_t invocations) {
  return (work + invocations - 1) / invocations;
}

}  // namespace clothstream::simulation
