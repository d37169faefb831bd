// SPDX-License-Identifier: MIT
// Compiles the kernels of scenes, and collects what the compiler says about them. Nothing runs.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel_statistics.h"
#include "tests/kernel_survey/survey_scenes.h"

namespace clothstream::kernel_survey {

// One kernel with one specialisation.
struct SurveyedKernel {
  std::string kernel;               // name of its source
  std::string settings;             // specialisation constants that are not false, such as "Air, Passes 7"
  std::uint32_t workgroupSize = 0;  // invocations
  std::uint32_t subgroupSize = 0;   // invocations; 0 if the driver does not say it
  std::string firstScene;           // the first scene that needs it
  std::uint32_t scenes = 0;         // scenes that need it
  std::vector<vulkan::KernelStatistic> statistics = {};  // empty if the driver does not tell
  // Per node of a scene and dispatch, for kernels whose work grows with the nodes: bytes of the bound
  // buffers, each read or written once, and invocations. Tables of fixed size count nothing, nor do lists of
  // near colliders.
  std::optional<double> bytesPerNode = {}, invocationsPerNode = {};

  // Value of the statistic with this name, if the driver tells it.
  std::optional<double> statistic(std::string_view name) const;
};

// Kernels of two ticks, a report, normals, a change of mass and two frames of the stream, in the order in
// which they appear first. The second tick has the scene's colliders, a sphere and a grab. `device` only
// compiles. Throws std::runtime_error if it refuses a kernel.
std::vector<SurveyedKernel> survey(vulkan::Device& device, std::span<const SurveyScene> scenes,
                                   const simulation::SimulationOptions& options = {});

}  // namespace clothstream::kernel_survey
