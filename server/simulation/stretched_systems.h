// SPDX-License-Identifier: MIT
// Systems of ACAD's grids that one workgroup solves for the ends of stretched springs only.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

#include "server/simulation/solve_tables.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Width of the workgroups on this device, and which cloths they can solve. `workgroupSize` 0 means the best
// one. The bits do not depend on it.
StretchedLimits stretchedLimits(const vulkan::Device& device, std::uint32_t workgroupSize,
                                std::uint32_t wholeNodes);

// Kernels by solver, created at their first use.
class StretchedKernels {
 public:
  StretchedKernels(const vulkan::Device& device, const StretchedLimits& limits)
      : device_(device), limits_(limits) {}
  const StretchedLimits& limits() const { return limits_; }
  // `continues`: the wide workgroups.
  vulkan::Kernel of(const SolveGroup& group, bool continues);

 private:
  const vulkan::Device& device_;
  StretchedLimits limits_;
  // By mode, bend springs, `continues` and width.
  std::map<std::tuple<std::size_t, bool, bool, std::uint32_t>, std::optional<vulkan::Kernel>> kernels_;
};

// Belongs to SolveStage and refers to its buffers. A substep has one dispatch per group, whose size is 0 if
// the forces found no spring that may be stretched; a second one continues solves that are too long for a
// workgroup of the best width.
class StretchedSystems {
 public:
  struct Buffers {
    const vulkan::Buffer &systems, &chunks, &vectors, &solves;
  };
  StretchedSystems(const vulkan::Device& device, StretchedKernels& kernels, const SolveTables& tables,
                   const StateBuffers& state, const Buffers& buffers);

  // Records what the stage does for a group of solve tables, after a barrier. `collides`: a collision of all
  // nodes follows.
  void record(vulkan::Recorder& recorder, const SolveGroup& group, std::uint32_t from, bool collides,
              double substepSeconds) const;
  void recordTables(vulkan::Recorder& recorder) const;

  // Solves leave the lists of shaders/solve/stretched_tables.glsl, and the springs of solve_stretched.comp.
  const vulkan::Buffer& lists() const { return lists_; }
  const vulkan::Buffer& springs() const { return springs_; }

 private:
  struct Group {
    std::uint32_t firstSystem = 0;
    std::vector<vulkan::Bindings> solve{}, next{};  // by the index of the state buffer with the state
  };

  std::uint32_t nodes_;
  StretchedLimits limits_;
  const vulkan::Buffer& stretches_;
  vulkan::Buffer lists_, springs_;
  std::vector<Group> groups_;
};

}  // namespace clothstream::simulation
