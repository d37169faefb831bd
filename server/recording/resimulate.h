// SPDX-License-Identifier: MIT
// `clothstream-server resimulate`: simulates a recording again and compares the result.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/model/scene.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/device.h"

namespace clothstream::recording {

// Distance of nodes from their recorded positions, metres.
struct Difference {
  std::uint64_t tick = 0;
  double largest = 0, mean = 0;
};

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
  std::string scene, recordedOn, device;  // names; recordedOn and device include the driver
};

struct ResimulateOptions {
  std::string path;
  // Options of the device for a scene with this number of nodes.
  std::function<vulkan::DeviceOptions(std::uint32_t nodes)> device;
  // Called after every tick; true stops the simulation.
  std::function<bool()> interrupted;
  // Called after every tick with the completed fraction, 0 to 1. May be empty.
  std::function<void(double)> progress;
  // Called after every tick with the state, and whether it equals the recorded one. May be empty.
  std::function<void(std::uint64_t tick, bool same, const simulation::NodeState& state)> states{};
};

// The error describes the problem of the file. Exceptions of the device pass through.
[[nodiscard]] tl::expected<Resimulation, std::string> resimulate(const ResimulateOptions& options);

// Report for people. The last line is the verdict.
std::string toText(const Resimulation& result);

}  // namespace clothstream::recording
