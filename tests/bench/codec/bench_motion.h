// SPDX-License-Identifier: MIT
// What codecs are measured on: motions by name, or a file.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {

struct BenchMotion {
  std::string name;
  codec::ClothLayout cloth;
  // Calls what it is given with each frame's positions, 3 floats a vertex.
  std::function<void(const std::function<void(std::span<const float>)>&)> play;
};

// Four of cloth_motion.h, which need no device, then named scenes of the server's, simulated on it.
std::vector<std::string> motionNames();

// Those that the settings choose: the first four where they choose none. The device must outlive them. Throws
// std::runtime_error where a name is not known or a file is no motion; playing it too, where a state is not
// healthy.
std::vector<BenchMotion> chosenMotions(vulkan::Device& device, const Settings& settings);

}  // namespace clothstream::bench
