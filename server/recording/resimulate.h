// SPDX-License-Identifier: MIT
// `clothstream-server resimulate`: a recording's ticks once more, compared with what they were.
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

// How far nodes are from where they were, metres.
struct Difference {
  std::uint64_t tick = 0;
  double largest = 0, mean = 0;
};

// What could not be simulated again.
struct Missing {
  std::uint64_t after = 0;             // tick
  std::optional<std::uint64_t> until;  // tick of the state from which it went on; nothing: there was none
  std::string reason;
};

struct Resimulation {
  std::uint64_t ticks = 0;      // simulated again
  std::uint64_t different = 0;  // of these, with another state than recorded
  bool interrupted = false;
  std::vector<Missing> missing;
  // Of the first that is different.
  std::optional<std::uint64_t> firstDifferent;
  std::uint64_t hash = 0, recordedHash = 0;
  // From there on, at every recorded state.
  std::vector<Difference> differences;
  std::string scene, recordedOn, device;  // names; the device with its driver
};

struct ResimulateOptions {
  std::string path;
  // For a scene of so many nodes.
  std::function<vulkan::DeviceOptions(std::uint32_t nodes)> device;
  // Asked after every tick.
  std::function<bool()> interrupted;
  // Told after every tick: how much of the recording is done, from 0 to 1. May be empty.
  std::function<void(double)> progress;
  // Told after every tick: whether the state is what it was, and the state. May be empty.
  std::function<void(std::uint64_t tick, bool same, const simulation::NodeState& state)> states{};
};

// The error says what is wrong with the file. Throws what the device throws.
[[nodiscard]] tl::expected<Resimulation, std::string> resimulate(const ResimulateOptions& options);

// For people; the last line is the verdict.
std::string toText(const Resimulation& result);

}  // namespace clothstream::recording
