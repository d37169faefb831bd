// SPDX-License-Identifier: MIT
// Settings and results of a benchmark suite.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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
  std::vector<std::string> scenes;  // of suite doctor; all built-in scenes if empty
  std::vector<std::uint32_t> crowds{1, 4, 16, 64, 256, 1000};  // numbers of scenes of suite batch
  std::filesystem::path pictures = ".";                        // directory of the pictures of suite behaviour
  // Input of the codec suites: named motions, or instead a file (bench_motion.h); number of frames of each;
  // max error in metres.
  std::vector<std::string> motions;
  std::optional<std::filesystem::path> input;
  std::uint32_t frames = 600;
  float maxError = 0.0005f;
  std::uint32_t encoderThreads = 1;
};

// A JSON object. Every row names its suite.
using Row = nlohmann::ordered_json;
using Rows = std::vector<Row>;

// Takes a row as soon as it is complete, so that a suite that is stopped leaves the rows before. A suite
// checks its results before it reports a time, and throws std::runtime_error if they are wrong.
using RowSink = std::function<void(const Row&)>;

struct Suite {
  const char* name;
  const char* description;
  void (*run)(vulkan::Device& device, const Settings& settings, const RowSink& add);
  bool compileOnly = false;  // the device is opened with vulkan::DeviceOptions::compileOnly
};

void runMassSpring(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runPaper(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runBehaviour(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runEqualStrain(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runCoarse(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runWorkPrecision(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runSolvers(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runEnforcement(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runAssembled(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runAcad(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runCurtain(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runColliders(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runGarment(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runSelfCollision(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runCodec(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runCodecDevice(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runPrice(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runBatch(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runDoctor(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runKernels(vulkan::Device& device, const Settings& settings, const RowSink& add);
void runCreation(vulkan::Device& device, const Settings& settings, const RowSink& add);

}  // namespace clothstream::bench
