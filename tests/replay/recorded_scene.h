// SPDX-License-Identifier: MIT
// A named scene that runs for some ticks, with somebody in it, and is recorded.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::replay {

// How long recordings of this scene are: so that they stay small, and have some frames.
std::uint32_t ticksFor(const model::Scene& scene);

// Runs a named scene while a ball goes through it, a hand pulls at it and the wind changes. Gives the path of
// the recording, in the directory. Throws std::runtime_error where it cannot be.
std::string recordScene(vulkan::Device& device, const std::string& name,
                        const std::filesystem::path& directory);

// A recording as it is kept: compressed whole, for its schemas are larger than the rest.
void compress(const std::string& recording, const std::string& to);
// Throws std::runtime_error where it cannot be read.
void decompress(const std::string& from, const std::string& recording);

}  // namespace clothstream::replay
