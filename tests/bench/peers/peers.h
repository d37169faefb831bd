// SPDX-License-Identifier: MIT
// The comparisons with other libraries.
#pragma once

#include "tests/bench/suite.h"

namespace clothstream::bench {

Rows compareMassSpring(vulkan::Device& device);
Rows compareCodecs(vulkan::Device& device);

}  // namespace clothstream::bench
