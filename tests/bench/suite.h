// SPDX-License-Identifier: MIT
// Settings and results of a benchmark suite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "server/vulkan/device.h"

namespace clothstream::bench {

struct Settings {
  vulkan::DeviceOptions device;
  std::optional<std::uint32_t> size;    // one grid size instead of several
  double seconds = 1;                   // minimum time of measuring for each row
  std::uint32_t rowsPerInvocation = 0;  // 0: chosen by the simulation
  std::uint32_t workgroupSize = 0;
  std::optional<std::uint32_t> xpbdWholeNodes;  // chosen by the simulation if absent
  std::optional<std::uint32_t> solveWholeNodes;
  std::filesystem::path pictures = ".";  // directory of the pictures of suite behaviour
  // Input of the codec suites: named motions, or instead a file (bench_motion.h); number of frames of each;
  // max error in metres.
  std::vector<std::string> motions;
  std::optional<std::filesystem::path> input;
  std::uint32_t frames = 600;
  float maxError = 0.0005f;
  std::uint32_t encoderThreads = 1;
};

// One JSON object for each row; every row names its suite. A suite checks its results before it reports a
// time, and throws std::runtime_error if they are wrong.
using Rows = std::vector<nlohmann::ordered_json>;

struct Suite {
  const char* name;
  const char* description;
  Rows (*run)(vulkan::Device& device, const Settings& settings);
  bool compileOnly = false;  // the device is opened with vulkan::DeviceOptions::compileOnly
};

Rows runMassSpring(vulkan::Device& device, const Settings& settings);
Rows runPaper(vulkan::Device& device, const Settings& settings);
Rows runBehaviour(vulkan::Device& device, const Settings& settings);
Rows runEqualStrain(vulkan::Device& device, const Settings& settings);
Rows runCoarse(vulkan::Device& device, const Settings& settings);
Rows runWorkPrecision(vulkan::Device& device, const Settings& settings);
Rows runSolvers(vulkan::Device& device, const Settings& settings);
Rows runEnforcement(vulkan::Device& device, const Settings& settings);
Rows runAssembled(vulkan::Device& device, const Settings& settings);
Rows runAcad(vulkan::Device& device, const Settings& settings);
Rows runCurtain(vulkan::Device& device, const Settings& settings);
Rows runColliders(vulkan::Device& device, const Settings& settings);
Rows runSelfCollision(vulkan::Device& device, const Settings& settings);
Rows runCodec(vulkan::Device& device, const Settings& settings);
Rows runCodecDevice(vulkan::Device& device, const Settings& settings);
Rows runPrice(vulkan::Device& device, const Settings& settings);
Rows runKernels(vulkan::Device& device, const Settings& settings);
Rows runCreation(vulkan::Device& device, const Settings& settings);

}  // namespace clothstream::bench
