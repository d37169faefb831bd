// SPDX-License-Identifier: MIT
// The comparisons with other libraries.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

// Each size on a device as the server would make it.
Rows compareMassSpring(const vulkan::DeviceOptions& options);
Rows compareCodecs(vulkan::Device& device);

}  // namespace clothstream::bench
