// SPDX-License-Identifier: MIT
// The comparisons with other libraries.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

// Each size on a device as the server would make it.
Rows compareMassSpring(const vulkan::DeviceOptions& options);
// The motions, sizes and errors that the settings say.
Rows compareCodecs(vulkan::Device& device, const Settings& settings);
// Bits against errors at max errors from 0.1 to 2 mm, also as pictures.
Rows codecCurves(vulkan::Device& device, const Settings& settings);

}  // namespace clothstream::bench
