// SPDX-License-Identifier: MIT
// What a benchmark suite is given, and what it gives back.
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
  std::optional<std::uint32_t> size;    // one grid size instead of a ladder
  double seconds = 1;                   // of measuring, a row
  std::uint32_t rowsPerInvocation = 0;  // 0: as the simulation chooses
  std::uint32_t workgroupSize = 0;
  std::optional<std::uint32_t> xpbdWholeNodes;  // likewise where it is absent
  std::optional<std::uint32_t> solveWholeNodes;
  std::filesystem::path pictures = ".";  // where suites that make some put them
  // Of what codecs are measured on: named motions, or instead of them a file (bench_motion.h); how much of
  // each; and the codecs' max error, m.
  std::vector<std::string> motions;
  std::optional<std::filesystem::path> input;
  std::uint32_t frames = 600;
  float maxError = 0.0005f;
  std::uint32_t encoderThreads = 1;
};

// One JSON object a row; every row names its suite. A suite checks its results before it reports a time, and
// throws std::runtime_error when they are wrong.
using Rows = std::vector<nlohmann::ordered_json>;

struct Suite {
  const char* name;
  const char* description;
  Rows (*run)(vulkan::Device& device, const Settings& settings);
};

Rows runMassSpring(vulkan::Device& device, const Settings& settings);
Rows runPaper(vulkan::Device& device, const Settings& settings);
Rows runBehaviour(vulkan::Device& device, const Settings& settings);
Rows runEqualStrain(vulkan::Device& device, const Settings& settings);
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

}  // namespace clothstream::bench
