// SPDX-License-Identifier: MIT
// Runs and records a named scene with a participant for some ticks.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::replay {

// The named scenes with a kept recording. That of `gown` would be larger than 150 kB, the limit for a file.
std::vector<std::string> keptScenes();

// Length of this scene's recordings in ticks: enough for some frames, and small files.
std::uint32_t ticksFor(const model::Scene& scene);

// Runs a named scene while a ball moves through it, a hand pulls at it and the wind changes. Returns the path
// of the recording in the directory. Throws std::runtime_error on failure.
std::string recordScene(vulkan::Device& device, const std::string& name,
                        const std::filesystem::path& directory);

// Compresses a whole recording, since its schemas are larger than the rest.
void compress(const std::string& recording, const std::string& to);
// Throws std::runtime_error if the file cannot be read.
void decompress(const std::string& from, const std::string& recording);

}  // namespace clothstream::replay
