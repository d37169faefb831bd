// SPDX-License-Identifier: MIT
// How a solve by one workgroup a cloth is cut into dispatches.
#include "server/simulation/solve_cut.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace clothstream::simulation {
namespace {

// lavapipe lets an invocation make this many rounds of loops, all loops together, and then ends each after
// one.
constexpr std::uint32_t kSoftwareRounds = 65'535;

}  // namespace

std::uint32_t roundsOfShare(float count, std::uint32_t workgroupSize) {
  return static_cast<std::uint32_t>(count) / workgroupSize + 2;
}

std::uint32_t roundsOfSum(float count, std::uint32_t workgroupSize) {
  // Loops round a loop end once more than they work.
  const std::uint32_t lanes = CLOTHSTREAM_SOLVE_LANES / workgroupSize + 2;
  const std::uint32_t tree = 2 * CLOTHSTREAM_SOLVE_LANES / workgroupSize + 16;
  return roundsOfShare(count, workgroupSize) + 2 * lanes + tree;
}

// A solve is one workgroup with barriers between its passes: on a software device these cost nothing as long
// as it is no wider than the CPU's vectors, for it then runs without switching between invocations.
SolveCut cutSolve(const vulkan::Device& device, std::uint32_t workgroupSize, const char* what,
                  const std::function<SolveRounds(std::uint32_t)>& roundsOf) {
  SolveCut cut{workgroupSize, ~0u};
  const std::uint32_t most = std::min(256u, device.limits().maxWorkgroupInvocations);
  if (!device.isSoftware()) {
    if (workgroupSize == 0) cut.workgroupSize = most;
    return cut;
  }
  if (workgroupSize == 0) cut.workgroupSize = 8;
  SolveRounds rounds = roundsOf(cut.workgroupSize);
  while (rounds.fixed + rounds.iteration > kSoftwareRounds) {
    if (cut.workgroupSize >= most)
      throw std::runtime_error(
          fmt::format("{} is more than its solver takes on {}", what, device.info().name));
    cut.workgroupSize *= 2;
    rounds = roundsOf(cut.workgroupSize);
  }
  cut.iterationsPerDispatch = (kSoftwareRounds - rounds.fixed) / rounds.iteration;
  return cut;
}

void recordSolve(vulkan::Recorder& recorder, const vulkan::Bindings& bindings, const SolveCut& cut,
                 std::uint32_t firstSystem, std::uint32_t systems, std::uint32_t iterations) {
  if (systems == 0) return;
  for (std::uint32_t first = 0; first < iterations;) {
    const std::uint32_t end = first + std::min(cut.iterationsPerDispatch, iterations - first);
    recorder.barrier();
    recorder.dispatch(bindings, shared::SolvePush{first, end, firstSystem},
                      std::uint64_t{systems} * cut.workgroupSize);
    first = end;
  }
}

}  // namespace clothstream::simulation
