// SPDX-License-Identifier: MIT
// Comparisons with other libraries.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

// Runs each size on a device that the server would choose for it.
Rows compareMassSpring(const vulkan::DeviceOptions& options);
// The first `ticks` ticks of each of the five stress scenes.
Rows compareNothingPasses(const vulkan::DeviceOptions& options, int ticks);
// Uses the motions, sizes and errors of the settings.
Rows compareCodecs(vulkan::Device& device, const Settings& settings);
// Bits against errors at max errors from 0.1 to 2 mm. plot.py draws the rows.
Rows codecCurves(vulkan::Device& device, const Settings& settings);

}  // namespace clothstream::bench
