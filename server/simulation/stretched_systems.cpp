// SPDX-License-Identifier: MIT
// Systems of ACAD's grids that one workgroup solves for the ends of stretched springs only.
#include "server/simulation/stretched_systems.h"

#include <algorithm>
#include <bit>

#include "kernels/solve_stretched.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {

using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;
using vulkan::Kernel;

namespace {

// shaders/solve/stretched_tables.glsl: numbers of a node and of a system in `lists`.
constexpr std::size_t kTables = 6, kHead = 8;
// lavapipe allows an invocation 65,535 loop rounds. Some are left for the short loops. On other devices the
// same number keeps a dispatch below some tens of milliseconds.
constexpr std::uint32_t kMostLoops = 60'000;
constexpr std::uint32_t kStretchedNodes = 65'536;

}  // namespace

StretchedLimits stretchedLimits(const vulkan::Device& device, std::uint32_t workgroupSize,
                                std::uint32_t wholeNodes) {
  const auto width = [&](std::uint32_t best) {
    return std::bit_floor(std::min(
        {best, std::uint32_t{CLOTHSTREAM_STRETCHED_INVOCATIONS}, device.limits().maxWorkgroupInvocations}));
  };
  const std::uint32_t narrow = width(workgroupSize != 0 ? workgroupSize : (device.hasGpuKernels() ? 512 : 8));
  return {.wholeNodes = std::min(wholeNodes, kStretchedNodes),
          .workgroup = narrow,
          .widestWorkgroup = width(CLOTHSTREAM_STRETCHED_INVOCATIONS),
          .mostLoops = kMostLoops};
}

Kernel StretchedKernels::of(const SolveGroup& group, bool continues) {
  const std::size_t mode = static_cast<std::size_t>(group.acadMode);
  const std::uint32_t workgroup = continues ? group.continuedWorkgroup : limits_.workgroup;
  std::optional<Kernel>& kernel = kernels_[{mode, group.bend, continues, workgroup}];
  if (!kernel)
    kernel.emplace(
        device_, kernels::solve_stretched, workgroup,
        std::initializer_list<std::uint32_t>{0u, 0u, group.bend ? 1u : 0u, 1u, continues ? 1u : 0u, 0u,
                                             group.acadMode == model::AcadMode::paper ? 1u : 0u});
  return *kernel;
}

StretchedSystems::StretchedSystems(const vulkan::Device& device, StretchedKernels& kernels,
                                   const SolveTables& tables, const StateBuffers& state,
                                   const Buffers& buffers)
    : nodes_(tables.nodes),
      limits_(kernels.limits()),
      stretches_(state.stretches),
      lists_(device, BufferPurpose::state,
             (kTables * nodes_ + kHead * tables.systems.size()) * sizeof(std::uint32_t)) {
  const bool bend =
      std::ranges::any_of(tables.groups, [](const SolveGroup& g) { return g.stretched && g.bend; });
  // Texels of two springs.
  springs_ =
      Buffer(device, BufferPurpose::texels, (bend ? 6 : 4) * std::size_t{nodes_} * sizeof(shared::vec4));
  for (const SolveGroup& on : tables.groups) {
    if (!on.stretched) continue;
    Group group{.firstSystem = on.firstSystem};
    for (const std::size_t from : {0, 1}) {
      const std::vector<const Buffer*> all = {&state.cloths,
                                              &buffers.systems,
                                              &buffers.chunks,
                                              state.positions[from],
                                              state.positions[1 - from],
                                              state.positions[1 - from],
                                              state.velocities[1 - from],
                                              state.velocities[1 - from],
                                              &buffers.vectors,
                                              &buffers.vectors,
                                              &springs_,
                                              &springs_,
                                              &lists_,
                                              &buffers.solves,
                                              &stretches_};
      group.solve.emplace_back(device, kernels.of(on, false), all);
      if (on.continuedWorkgroup != 0) group.next.emplace_back(device, kernels.of(on, true), all);
    }
    groups_.push_back(std::move(group));
  }
}

void StretchedSystems::recordTables(vulkan::Recorder& recorder) const {
  recorder.fill(lists_, 0, lists_.bytes());
}

void StretchedSystems::record(vulkan::Recorder& recorder, const SolveGroup& on, std::uint32_t from,
                              bool collides, double h) const {
  const Group& group = *std::ranges::find(groups_, on.firstSystem, &Group::firstSystem);
  const Follow follow = followOf(on.acadMode);
  const shared::StretchedPush push{.nodes = nodes_,
                                   .firstSystem = on.firstSystem,
                                   .systems = on.endSystem - on.firstSystem,
                                   .rounds = roundsOf(on),
                                   .stretchSize = firstStretchSize(follow),
                                   .nextSize = firstContinuedSize(follow),
                                   .firstMark = kFirstMark,
                                   .mostLoops = limits_.mostLoops,
                                   .substepSeconds = static_cast<float>(h),
                                   .substepRate = static_cast<float>(1 / h),
                                   .collides = collides ? 1u : 0u,
                                   .reserved = 0};
  constexpr std::uint64_t kChunkNodes = CLOTHSTREAM_SOLVE_LANES * CLOTHSTREAM_SOLVE_WALK;
  const std::uint64_t chunks = std::max(on.smallChunks, on.endChunk - on.firstLargeChunk);
  const std::uint64_t ofSystem = chunks * kChunkNodes * on.iterations * push.rounds;
  // Indirect dispatches cannot be divided. Without one, workgroups find that nothing is marked.
  const auto dispatch = [&](const Bindings& solve, std::uint32_t size) {
    const std::uint32_t width = solve.kernel().workgroupSize();
    const std::uint64_t threads = std::uint64_t{push.systems} * width,
                        work = workPerInvocation(ofSystem, width);
    if (recorder.divides(solve, threads, work))
      recorder.dispatch(solve, push, threads, work);
    else
      recorder.dispatchIndirect(solve, push, stretches_, size * sizeof(std::uint32_t), threads * work);
  };
  dispatch(group.solve[from], push.stretchSize);
  if (group.next.empty()) return;
  recorder.barrier();
  dispatch(group.next[from], push.nextSize);
}

}  // namespace clothstream::simulation
