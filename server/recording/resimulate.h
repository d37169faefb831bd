// SPDX-License-Identifier: MIT
// `clothstream-server resimulate`: simulates a recording again and compares the result.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "proto/recording/recording_reader.h"
#include "proto/recording/verdict.h"
#include "server/model/scene.h"
#include "server/recording/frame_distance.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/device.h"

namespace clothstream::recording {

// Part of a recording that could not be simulated again.
struct Missing {
  std::uint64_t after = 0;             // tick
  std::optional<std::uint64_t> until;  // tick of the state from which the simulation continued; absent: none
  std::string reason;
};

struct Resimulation {
  std::uint64_t ticks = 0;      // number of simulated ticks
  std::uint64_t different = 0;  // number of ticks whose state differs from the recording
  bool interrupted = false;
  std::vector<Missing> missing;
  // First tick that differs, with its hashes.
  std::optional<std::uint64_t> firstDifferent;
  std::uint64_t hash = 0, recordedHash = 0;
  // Differences at every recorded state from there on.
  std::vector<Difference> differences;
  // Frames from there on that were compared with the states of their ticks, and the largest difference.
  // Frames are within sqrt(3) max error of the state that they show (metres).
  std::uint64_t frames = 0;
  Difference largestOfFrames;
  FrameFaults faults;  // frames that cannot be decoded; their states cannot be shown
  double maxError = 0;
  std::string scene, recordedOn, device;  // names; recordedOn and device include the driver
  // Whether this program has the kernels of the recording.
  Kernels kernels = Kernels::unknown;

  Verdict verdict() const {
    return verdictOf(firstDifferent.has_value(), !missing.empty() || faults.any(), kernels);
  }
};

// A state that was simulated, or from which the simulation started or continued.
struct SimulatedState {
  const simulation::StateSnapshot& snapshot;  // its tick is set
  std::uint64_t hash = 0;
  bool given = false;  // the recording has this state, and the simulation starts or continues from it
  bool same = true;    // it equals the recorded state
  const model::Scene& scene;
};

struct ResimulateOptions {
  std::string path;
  ReadLimits limits{};
  // Options of the device for a scene with this number of nodes.
  std::function<vulkan::DeviceOptions(std::uint32_t nodes)> device;
  // Called after every tick; true stops the simulation.
  std::function<bool()> interrupted;
  // Called after every tick with the completed fraction, 0 to 1. May be empty.
  std::function<void(double)> progress;
  // Called at the start, after every tick, and where the simulation continues after a missing part. May be
  // empty.
  std::function<void(const SimulatedState&)> states{};
};

// The error describes the problem of the file. Exceptions of the device pass through.
[[nodiscard]] tl::expected<Resimulation, std::string> resimulate(const ResimulateOptions& options);

// Report for people. The last line is the verdict.
std::string toText(const Resimulation& result);
// The same as one JSON object, with the verdict and the exit code.
std::string toJson(const Resimulation& result);

}  // namespace clothstream::recording
