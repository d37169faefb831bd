// SPDX-License-Identifier: MIT
// How a solve by one workgroup a cloth is cut into dispatches.
#pragma once

#include <cstdint>
#include <functional>

#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// The results do not depend on it.
struct SolveCut {
  std::uint32_t workgroupSize;
  std::uint32_t iterationsPerDispatch;
};

// Rounds of loops of one invocation: of the solve's beginning and end, and of an iteration.
struct SolveRounds {
  std::uint32_t fixed, iteration;
};

// `roundsOf` says how many rounds the largest system takes with a workgroup of a size. `workgroupSize` 0: the
// measured best for the device. Throws std::runtime_error, saying that `what` is too large, where no
// workgroup of the device does an iteration.
SolveCut cutSolve(const vulkan::Device& device, std::uint32_t workgroupSize, const char* what,
                  const std::function<SolveRounds(std::uint32_t)>& roundsOf);

// Invocations share `count` elements, or the fixed lanes of a sum: rounds of one of them, with the last that
// ends the loop.
std::uint32_t roundsOfShare(float count, std::uint32_t workgroupSize);
// And of a sum over `count` elements.
std::uint32_t roundsOfSum(float count, std::uint32_t workgroupSize);

// `iterations` of the `systems` from `firstSystem` on, a barrier before each dispatch.
void recordSolve(vulkan::Recorder& recorder, const vulkan::Bindings& bindings, const SolveCut& cut,
                 std::uint32_t firstSystem, std::uint32_t systems, std::uint32_t iterations);

}  // namespace clothstream::simulation
