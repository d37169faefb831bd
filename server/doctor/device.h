// SPDX-License-Identifier: MIT
// Checks of the Vulkan devices, and what the chosen one carries.
#pragma once

#include <chrono>
#include <functional>

#include "server/doctor/finding.h"
#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::doctor {

// The devices, the one that `options` choose, and its limits.
Findings checkDevices(const vulkan::DeviceOptions& options);

// Makes the options for a scene of this many nodes.
using OptionsFor = std::function<vulkan::DeviceOptions(std::uint32_t nodes)>;

// The largest square sheet that the device simulates and encodes at 72 ticks per second: mass-spring with ten
// substeps, and implicit Euler with two. Ticks may take 80 % of their period. Grids grow from 32x32 by a half
// of their side until one does not fit, or until `time` has passed; the first is always tried.
Findings measureCapacity(const OptionsFor& options, std::chrono::duration<double> time);

// Estimate of the number of scenes that this machine carries at 72 ticks and frames per second: sheets of
// 1,024 and of 10,000 vertices, mass-spring with ten substeps. It follows from the measured speed of the
// device, from the price of a scene and from the measured processor time of a frame. Takes some seconds.
Findings estimateCrowds(const OptionsFor& options);

}  // namespace clothstream::doctor
