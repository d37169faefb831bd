// SPDX-License-Identifier: MIT
// `clothstream-server step`: writes a scene's ticks into a file, without clock or network.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::step {

struct StepOptions {
  std::uint64_t ticks = 0;
  std::uint64_t every = 1;  // ticks between frames; the first frame is the start
  std::filesystem::path out = {};
  std::string serverName = {};
};

enum class Outcome : std::uint8_t { complete, interrupted, unhealthy };

// Simulates the scene as a server without participants does, with the same states to the bit. Prints progress
// on standard error once per second. Calls `interrupted` after every tick. Unless it throws, the file and its
// description are valid and have the frames so far. Throws std::runtime_error.
Outcome run(vulkan::Device& device, const model::Scene& scene, const StepOptions& options,
            const std::function<bool()>& interrupted);

}  // namespace clothstream::step
