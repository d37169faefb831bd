// SPDX-License-Identifier: MIT
// Motions that codecs are measured on: by name, or from a file.
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
  // Calls its argument with each frame's positions, 3 floats a vertex.
  std::function<void(const std::function<void(std::span<const float>)>&)> play;
};

// Names of four motions of cloth_motion.h, which need no device, then of scenes of the server, simulated on
// the device.
std::vector<std::string> motionNames();

// Motions that the settings choose; the first four if they name none. The device must outlive them. Throws
// std::runtime_error if a name is unknown or a file is no motion. Playing a motion throws if a state is not
// healthy.
std::vector<BenchMotion> chosenMotions(vulkan::Device& device, const Settings& settings);

}  // namespace clothstream::bench
