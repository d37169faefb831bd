// SPDX-License-Identifier: MIT
// The springs of cloths with ACAD that are constraints, for reports that name them.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/simulation/solve_tables.h"
#include "server/simulation/stretched_systems.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// These tables name the springs of the systems with ACAD.
struct ActiveTables {
  std::vector<SolveGroup> groups;
  std::vector<shared::SystemRecord> systems;  // of these groups
  // The ends of each spring of their meshes, numbered from the cloth's first node. Springs of a group follow
  // each other.
  std::vector<std::array<std::uint32_t, 2>> ends;
  std::uint32_t nodes = 0;  // of the scene
};
ActiveTables activeTables(const SolveTables& tables);

// Belongs to SolveStage and refers to its buffers.
class ActiveSprings {
 public:
  struct Buffers {
    const vulkan::Buffer &cloths, &systems, &chunks, &solves, &along, &rows, &vectors;
    const StretchedSystems* stretched;  // null if no group uses it
  };
  // `workgroupSize` must divide the lanes of a chunk.
  ActiveSprings(const vulkan::Device& device, ActiveTables tables, const Buffers& buffers,
                std::uint32_t workgroupSize);

  // Marks the springs that the last recorded substep held. Begins with a barrier.
  void record(vulkan::Recorder& recorder) const;
  // Appends the ends of the springs of a complete recording to the list of their cloth, two numbers a spring,
  // at most 2 * `most` in all, the first cloth's first. Springs of a grid are ordered by the node that owns
  // them, then by kind; springs of a mesh as in model::systemLinks().
  void collect(std::size_t most, std::span<std::vector<std::uint32_t>> ofCloths) const;

 private:
  struct Group {
    SolveGroup on;
    std::uint32_t firstMark = 0;  // of its springs, if its cloths are meshes
    vulkan::Bindings bindings;
  };

  // Where the marks of a cloth are.
  struct System {
    std::uint32_t cloth = 0;
    std::uint32_t firstMark = 0;
    std::uint32_t nodes = 0;  // of a grid; each has a mark
    std::int64_t columns = 0;
    std::uint32_t springs = 0;  // of a mesh; each has a bit of the marks, from firstBit on
    std::uint32_t firstBit = 0, firstEnd = 0;
  };

  std::uint32_t workgroupSize_;
  ActiveTables of_;
  vulkan::Buffer marks_, readback_;
  std::vector<Group> groups_;
  std::vector<System> systems_;  // by cloth
};

}  // namespace clothstream::simulation
