// SPDX-License-Identifier: MIT
// Marks of the springs that are constraints.
#include "server/simulation/active_springs.h"

#include <algorithm>
#include <bit>

#include "kernels/mark_grids.h"
#include "kernels/mark_meshes.h"
#include "kernels/mark_stretched.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {
namespace {

using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;
using vulkan::Kernel;

constexpr std::uint32_t kMarked = CLOTHSTREAM_MARKED_SPRINGS;

std::uint32_t marksOf(const SolveGroup& group) {
  return (group.endSpring - group.firstSpring + kMarked - 1) / kMarked;
}

std::uint32_t allMarks(const ActiveTables& tables) {
  std::uint32_t marks = tables.nodes;
  for (const SolveGroup& group : tables.groups) marks += marksOf(group);
  return marks;
}

std::uint32_t firstSpringOf(const shared::SystemRecord& system) {
  return shared::wholeNumber(system.firstSpringLow, system.firstSpringHigh);
}

Bindings bind(const vulkan::Device& device, const SolveGroup& group, const ActiveSprings::Buffers& b,
              const Buffer& marks, std::uint32_t workgroupSize) {
  const auto kernel = [&](const vulkan::KernelCode& code) {
    return Kernel(device, code, workgroupSize, {0u, group.mesh ? 1u : 0u, group.bend ? 1u : 0u, 1u});
  };
  if (group.stretched)
    return Bindings(device, kernel(kernels::mark_stretched),
                    {&b.cloths, &b.systems, &b.chunks, &b.vectors, &b.stretched->springs(),
                     &b.stretched->lists(), &b.solves, &marks});
  if (group.mesh)
    return Bindings(device, kernel(kernels::mark_meshes),
                    {&b.cloths, &b.systems, &b.chunks, &b.rows, &marks});
  return Bindings(device, kernel(kernels::mark_grids),
                  {&b.cloths, &b.systems, &b.chunks, &b.along, &b.solves, &marks});
}

}  // namespace

ActiveTables activeTables(const SolveTables& tables) {
  ActiveTables active;
  active.nodes = tables.nodes;
  for (const SolveGroup& group : tables.groups) {
    if (group.kind != model::SolverKind::acad) continue;
    active.groups.push_back(group);
    for (std::uint32_t i = group.firstSystem; i < group.endSystem; ++i) {
      const shared::SystemRecord& system = active.systems.emplace_back(tables.systems[i]);
      const auto firstNode = static_cast<std::uint32_t>(system.firstNode);
      const std::uint32_t first = firstSpringOf(system);
      for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(system.springCount); ++j) {
        const shared::LinkRecord& link = tables.springs[first + j];
        active.ends.push_back(
            {static_cast<std::uint32_t>(link.a) - firstNode, static_cast<std::uint32_t>(link.b) - firstNode});
      }
    }
  }
  return active;
}

ActiveSprings::ActiveSprings(const vulkan::Device& device, ActiveTables tables, const Buffers& buffers,
                             std::uint32_t workgroupSize)
    : workgroupSize_(workgroupSize),
      of_(std::move(tables)),
      marks_(device, BufferPurpose::state, allMarks(of_) * sizeof(std::uint32_t)),
      readback_(device, BufferPurpose::readback, marks_.bytes()) {
  std::uint32_t firstMark = of_.nodes, firstEnd = 0;
  auto record = of_.systems.begin();
  for (const SolveGroup& on : of_.groups) {
    for (std::uint32_t i = on.firstSystem; i < on.endSystem; ++i, ++record) {
      System& system = systems_.emplace_back();
      system.cloth = static_cast<std::uint32_t>(record->cloth);
      if (on.mesh) {
        system.firstMark = firstMark;
        system.firstBit = firstSpringOf(*record) - on.firstSpring;
        system.springs = static_cast<std::uint32_t>(record->springCount);
        system.firstEnd = firstEnd;
        firstEnd += system.springs;
      } else {
        system.firstMark = static_cast<std::uint32_t>(record->firstNode);
        system.nodes = static_cast<std::uint32_t>(record->nodeCount);
        system.columns = static_cast<std::int64_t>(record->columns);
      }
    }
    groups_.push_back({on, firstMark, bind(device, on, buffers, marks_, workgroupSize_)});
    firstMark += marksOf(on);
  }
  std::ranges::sort(systems_, {}, &System::cloth);
}

void ActiveSprings::record(vulkan::Recorder& recorder) const {
  constexpr std::uint64_t kChunkNodes = CLOTHSTREAM_SOLVE_LANES * CLOTHSTREAM_SOLVE_WALK;
  recorder.barrier();
  recorder.fill(marks_, 0, marks_.bytes());
  recorder.barrier();
  for (const Group& group : groups_) {
    const shared::MarkPush push{.nodes = of_.nodes,
                                .firstChunk = group.on.firstChunk,
                                .firstSpring = group.on.firstSpring,
                                .endSpring = group.on.endSpring,
                                .firstMark = group.firstMark};
    if (group.on.mesh)
      recorder.dispatch(group.bindings, push, marksOf(group.on));
    else
      recorder.dispatch(group.bindings, push,
                        std::uint64_t{group.on.endChunk - group.on.firstChunk} * workgroupSize_,
                        workPerInvocation(kChunkNodes, workgroupSize_));
  }
  recorder.barrier();
  recorder.copy(marks_, readback_, marks_.bytes());
}

void ActiveSprings::collect(std::size_t most, std::span<std::vector<std::uint32_t>> ofCloths) const {
  const std::span<const std::uint32_t> marks = readback_.mapped<const std::uint32_t>();
  // Rows and columns from the owner to the other end, by bit.
  constexpr std::array<std::array<int, 2>, CLOTHSTREAM_GRID_SPRINGS> kOffsets = {
      {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}}};
  std::size_t left = most;
  for (const System& system : systems_) {
    std::vector<std::uint32_t>& ends = ofCloths[system.cloth];
    const auto add = [&](std::uint32_t a, std::uint32_t b) {
      ends.push_back(a);
      ends.push_back(b);
      --left;
    };
    for (std::uint32_t i = 0; i < system.springs && left > 0; ++i) {
      const std::uint32_t place = system.firstBit + i;
      if ((marks[system.firstMark + place / kMarked] >> place % kMarked & 1) != 0)
        add(of_.ends[system.firstEnd + i][0], of_.ends[system.firstEnd + i][1]);
    }
    for (std::uint32_t node = 0; node < system.nodes && left > 0; ++node)
      for (std::uint32_t bits = marks[system.firstMark + node]; bits != 0 && left > 0; bits &= bits - 1) {
        const std::array<int, 2>& to = kOffsets[static_cast<std::size_t>(std::countr_zero(bits))];
        add(node, static_cast<std::uint32_t>(node + to[0] * system.columns + to[1]));
      }
  }
}

}  // namespace clothstream::simulation
