// SPDX-License-Identifier: MIT
// Random numbers that name servers and streams.
#pragma once

#include <cstdint>
#include <random>

namespace clothstream::fleet {

// Not 0.
inline std::uint64_t randomId() {
  std::random_device random;
  return (std::uint64_t{random()} << 32 | random()) | 1;
}

}  // namespace clothstream::fleet
