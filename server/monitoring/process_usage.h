// SPDX-License-Identifier: MIT
// Resources that this process uses, from /proc/self.
#pragma once

#include <cstdint>

namespace clothstream::monitoring {

// Values that the system does not report are 0.
struct ProcessUsage {
  std::uint64_t residentBytes = 0;
  std::uint64_t openDescriptors = 0;
  std::uint64_t threads = 0;
};

ProcessUsage processUsage();

}  // namespace clothstream::monitoring
