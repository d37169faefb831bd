// SPDX-License-Identifier: MIT
// `clothstream-server step`: a scene's ticks without clock or network, into a file.
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
  std::uint64_t every = 1;  // ticks between frames; the start is the first frame
  std::filesystem::path out = {};
  std::string serverName = {};
};

enum class Outcome : std::uint8_t { complete, interrupted, unhealthy };

// The scene by itself, as a server runs it with nobody in it: the same states, to the bit. Says on standard
// error once a second how far it is. `interrupted` is asked after every tick. However it ends but by an
// exception, the file and what stands beside it are valid, with the frames so far. Throws std::runtime_error.
Outcome run(vulkan::Device& device, const model::Scene& scene, const StepOptions& options,
            const std::function<bool()>& interrupted);

}  // namespace clothstream::step
